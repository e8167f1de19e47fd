// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/features/sheet_pads.h"

#include "subvol/fit/features/boundary_patches.h"
#include "subvol/mesh/interfaces.h"
#include "subvol/mesh/mesh_topology.h"
#include "subvol/mesh/validate.h"
#include "subvol/surface/welded_surface.h"

#include <algorithm>
#include <array>
#include <set>
#include <span>
#include <utility>

namespace subvol::internal {

namespace {

constexpr double kFlatSheetAngle = 180;  // degrees

/// Returns the boundary of a body, some of the regions, oriented outward and on the vertices of the target.
TriangleMesh boundary_of_body(const RegionSurface& target, const std::set<int>& references) {
  TriangleMesh boundary{target.mesh.positions, {}};
  for (std::size_t t = 0; t < target.sides.size(); ++t) {
    const bool is_behind = references.contains(target.sides[t][0]),
               is_in_front = references.contains(target.sides[t][1]);
    if (is_behind == is_in_front) continue;
    std::array<Index, 3> corners = target.mesh.triangles[t];
    if (is_in_front) std::swap(corners[1], corners[2]);
    boundary.triangles.push_back(corners);
  }
  return boundary;
}

bool has_manifold_boundary(const VolumeMesh& mesh) {
  return std::ranges::none_of(validate(mesh), [](const MeshDefect& defect) {
    return defect.kind == MeshDefect::Kind::nonmanifold_edge || defect.kind == MeshDefect::Kind::nonmanifold_vertex;
  });
}

/// Returns the angles of a body along the curves on its surface, and a straight angle for all other curves.
SignedFeatures features_of_body(const TriangleMesh& surface, const FeatureCurves& curves) {
  std::set<std::array<Index, 2>> edges;
  for_each_edge(sorted_half_edges(surface.triangles, surface.positions.size()),
                [&](std::span<const SurfaceHalfEdge> edge) {
                  if (edge.size() == 2) edges.insert({edge[0].low, edge[0].high});
                });
  const auto is_on_surface = [&](const FeatureCurve& curve) {
    for (std::size_t i = 0; i + 1 < curve.vertices.size(); ++i) {
      const auto [low, high] = std::minmax(curve.vertices[i], curve.vertices[i + 1]);
      if (!edges.contains({low, high})) return false;
    }
    return true;
  };
  FeatureCurves some;
  std::vector<std::size_t> places;
  for (std::size_t c = 0; c < curves.curves.size(); ++c)
    if (is_on_surface(curves.curves[c])) {
      some.curves.push_back(curves.curves[c]);
      places.push_back(c);
    }
  SignedFeatures result;
  result.curves = curves;
  result.angles.assign(curves.curves.size(), kFlatSheetAngle);
  const SignedFeatures measured = signed_features(surface, std::move(some));
  for (std::size_t i = 0; i < places.size(); ++i) result.angles[places[i]] = measured.angles[i];
  return result;
}

/// Some of the regions, as a mesh whose boundary is padded.
struct Body {
  PatchedMesh patched;
  std::vector<std::size_t> cells;  ///< their numbers in the whole mesh
  bool is_sound = true;            ///< its boundary is a manifold, and each path is in or on it or outside, as a whole
};

/// Pads in the making, of one body after the other.
class SheetPadding {
 public:
  SheetPadding(PatchedSheets& sheets, const RegionSurface& target, const FeatureCurves& curves);

  bool run();
  std::size_t num_pads() const { return pads_; }

 private:
  Body body(const std::set<int>& references) const;
  void add_paths(Body& body, const MeshTopology& topology) const;
  void add_interfaces(Body& body, const MeshTopology& topology) const;
  void measure_angles(PatchedMesh& body, const MeshTopology& topology, const TriangleMesh& surface) const;
  PadReport pad_body(Body& body, const std::set<int>& references);
  bool pad_all();
  bool pad_region(int reference);
  void pad_through_neighbors(int reference, const MissedPad& missed);
  std::optional<int> neighbor_at(const std::set<int>& references, std::span<const Index> patches, Index vertex) const;
  void take(Body& body, const std::vector<FaceKey>& boundary_before);

  PatchedSheets& sheets_;
  const RegionSurface& target_;
  const FeatureCurves& curves_;
  std::set<int> all_;           ///< the references of all regions
  std::vector<PadRule> rules_;  ///< of patches, in the body of all regions
  std::size_t pads_ = 0;
};

SheetPadding::SheetPadding(PatchedSheets& sheets, const RegionSurface& target, const FeatureCurves& curves)
    : sheets_(sheets), target_(target), curves_(curves) {
  for (const Group& region : target.regions) all_.insert(region.number);
}

/// Returns a body with its patches and paths.
Body SheetPadding::body(const std::set<int>& references) const {
  Body body;
  PatchedMesh& patched = body.patched;
  patched.mesh.positions = sheets_.mesh.positions;
  for (std::size_t c = 0; c < sheets_.mesh.num_cells(); ++c) {
    if (!references.contains(sheets_.mesh.references[c])) continue;
    body.cells.push_back(c);
    patched.mesh.add_cell(sheets_.mesh.kinds[c], sheets_.mesh.cell(c));
    patched.mesh.references.push_back(sheets_.mesh.references[c]);
  }
  body.is_sound = has_manifold_boundary(patched.mesh);
  if (!body.is_sound) return body;
  patched.fitted = sheets_.fitted;
  patched.corners = sheets_.corners;
  patched.patches.count = sheets_.num_patches;
  patched.shared.assign(sheets_.num_patches, 0);
  const MeshTopology topology(patched.mesh), whole(sheets_.mesh);
  for (const Index f : topology.boundary_faces())
    patched.patches.of_face.push_back(sheets_.patches.at(face_key(topology.face(f))));
  for (const Index f : find_interfaces(sheets_.mesh, whole).faces) {
    const auto& [a, b] = whole.face_cells(f);
    if (references.contains(sheets_.mesh.references[a]) != references.contains(sheets_.mesh.references[b]))
      patched.shared[sheets_.patches.at(face_key(whole.face(f)))] = 1;
  }
  if (references != all_)
    for (std::size_t p = 0; p < sheets_.num_patches; ++p)
      patched.rules.push_back(patched.shared[p] || rules_[p] == PadRule::never ? PadRule::free : PadRule::joining);
  else
    patched.rules.assign(sheets_.num_patches, PadRule::free);
  add_paths(body, topology);
  add_interfaces(body, topology);
  return body;
}

void SheetPadding::add_paths(Body& body, const MeshTopology& topology) const {
  for (const CreasePath& path : sheets_.paths) {
    const std::size_t edges = path.vertices.size() - 1;
    std::size_t outer = 0, inner = 0;
    for (std::size_t i = 0; i < edges; ++i) {
      const Index edge = topology.find_edge(path.vertices[i], path.vertices[i + 1]);
      if (edge != kNoIndex) ++(topology.is_boundary_edge(edge) ? outer : inner);
    }
    if (outer == edges)
      body.patched.paths.push_back(path);
    else if (inner == edges)
      body.patched.inner_paths.push_back(path);
    else if (outer + inner > 0)
      body.is_sound = false;
  }
}

/// Adds the interfaces between the body's regions. A pad that ended where two regions meet would give one of them a
/// part of the other's boundary, and where a third region lies between both without a face on the boundary, pads would
/// cut it off from there.
void SheetPadding::add_interfaces(Body& body, const MeshTopology& topology) const {
  PatchedMesh& patched = body.patched;
  std::vector<std::uint8_t> ends(topology.num_edges(), 0);  // number of inner faces at each edge of the boundary
  for (const Index f : find_interfaces(patched.mesh, topology).faces) {
    const auto face = topology.face(f);
    InnerFace inner{{kNoIndex, kNoIndex, kNoIndex, kNoIndex}, sheets_.patches.at(face_key(face))};
    std::ranges::copy(face, inner.corners.begin());
    patched.inner_faces.push_back(inner);
    for (std::size_t i = 0; i < face.size(); ++i) {
      const Index edge = topology.find_edge(face[i], face[(i + 1) % face.size()]);
      ends[edge] += topology.is_boundary_edge(edge);
    }
  }
  const auto faces = topology.boundary_faces();
  std::vector<Index> patch_at_edge(topology.num_edges(), kNoIndex);
  for (std::size_t i = 0; i < faces.size(); ++i) {
    const auto face = topology.face(faces[i]);
    const Index patch = patched.patches.of_face[i];
    for (std::size_t k = 0; k < face.size(); ++k) {
      const Index edge = topology.find_edge(face[k], face[(k + 1) % face.size()]);
      if (!ends[edge]) continue;
      if (ends[edge] > 1) patched.rules[patch] = PadRule::never;
      if (patch_at_edge[edge] != kNoIndex) patched.united.push_back({patch_at_edge[edge], patch});
      patch_at_edge[edge] = patch;
    }
  }
}

/// Measures the angles at edges of the body that lie on no path, but for those at sides of pads, which have no area yet
/// where the mesh is fitted.
void SheetPadding::measure_angles(PatchedMesh& body, const MeshTopology& topology, const TriangleMesh& surface) const {
  std::set<std::array<Index, 2>> at_sides;
  for (const Index f : topology.boundary_faces()) {
    const auto face = topology.face(f);
    bool is_side = false;
    for (std::size_t i = 0; i < face.size(); ++i)
      is_side |= body.fitted[face[i]] == body.fitted[face[(i + 1) % face.size()]];
    for (std::size_t i = 0; is_side && i < face.size(); ++i) {
      const auto [low, high] = std::minmax(face[i], face[(i + 1) % face.size()]);
      at_sides.insert({low, high});
    }
  }
  body.angles = smooth_edge_angles(topology, body.paths, body.fitted, surface);
  std::erase_if(body.angles, [&](const EdgeAngle& angle) { return at_sides.contains(angle.ends); });
}

/// Pads a body from inside and puts it back in its place.
PadReport SheetPadding::pad_body(Body& body, const std::set<int>& references) {
  const MeshTopology topology(body.patched.mesh);
  std::vector<FaceKey> before;
  for (const Index f : topology.boundary_faces()) before.push_back(face_key(topology.face(f)));
  for (const InnerFace& face : body.patched.inner_faces) before.push_back(face_key(face.vertices()));
  const TriangleMesh surface = boundary_of_body(target_, references);
  measure_angles(body.patched, topology, surface);
  PadReport report = add_pads(body.patched, features_of_body(surface, curves_));
  pads_ += report.pads.size();
  if (!report.pads.empty()) take(body, before);
  return report;
}

/// Pads the boundary through all regions. Returns false if that is not possible.
bool SheetPadding::pad_all() {
  Body all = body(all_);
  if (!all.is_sound) return false;
  rules_ = all.patched.rules;
  return pad_body(all, all_).missed.empty();
}

/// Returns a region beyond the body at a vertex where a pad under some patches is refused; not one beyond these
/// patches.
std::optional<int> SheetPadding::neighbor_at(const std::set<int>& references, std::span<const Index> patches,
                                             Index vertex) const {
  const MeshTopology whole(sheets_.mesh);
  std::set<int> beyond_vertex, beyond_patches;
  for (const Index f : find_interfaces(sheets_.mesh, whole).faces) {
    const auto& [a, b] = whole.face_cells(f);
    const int of_a = sheets_.mesh.references[a], of_b = sheets_.mesh.references[b];
    if (references.contains(of_a) == references.contains(of_b)) continue;
    const int other = references.contains(of_a) ? of_b : of_a;
    const auto face = whole.face(f);
    if (std::ranges::binary_search(patches, sheets_.patches.at(face_key(face))))
      beyond_patches.insert(other);
    else if (std::ranges::find(face, vertex) != face.end())
      beyond_vertex.insert(other);
  }
  for (const int other : beyond_vertex)
    if (!beyond_patches.contains(other)) return other;
  return std::nullopt;
}

/// Makes a pad that a region cannot have alone, in a body of this region and as many of its neighbors as needed. Does
/// nothing if there is no such body.
void SheetPadding::pad_through_neighbors(int reference, const MissedPad& missed) {
  std::set<int> references{reference};
  while (true) {
    Body through = body(references);
    if (!through.is_sound) return;
    PatchedMesh& patched = through.patched;
    patched.grows_to_shared = false;
    for (std::size_t p = 0; p < patched.rules.size(); ++p)
      if (patched.rules[p] == PadRule::free && !std::ranges::binary_search(missed.patches, static_cast<Index>(p)))
        patched.rules[p] = PadRule::joining;
    const PadReport report = pad_body(through, references);
    if (report.missed.empty()) return;
    const std::optional<int> neighbor = neighbor_at(references, missed.patches, report.missed.front().refusal.vertex);
    if (!neighbor) return;
    references.insert(*neighbor);
  }
}

/// Pads a region. Returns false if that is not possible.
bool SheetPadding::pad_region(int reference) {
  const std::set<int> references{reference};
  Body strict = body(references);
  if (!strict.is_sound) return false;
  strict.patched.grows_to_shared = false;
  for (const MissedPad& missed : pad_body(strict, references).missed) pad_through_neighbors(reference, missed);
  Body rest = body(references);
  return rest.is_sound && pad_body(rest, references).missed.empty();
}

/// Puts a padded body back in its place. before: the faces of its sheets before it was padded.
void SheetPadding::take(Body& body, const std::vector<FaceKey>& before) {
  PatchedMesh& patched = body.patched;
  for (const FaceKey& face : before) sheets_.patches.erase(face);
  const MeshTopology topology(patched.mesh);
  const auto faces = topology.boundary_faces();
  for (std::size_t i = 0; i < faces.size(); ++i)
    sheets_.patches[face_key(topology.face(faces[i]))] = patched.patches.of_face[i];
  for (const InnerFace& face : patched.inner_faces) sheets_.patches[face_key(face.vertices())] = face.patch;
  for (auto* paths : {&patched.paths, &patched.inner_paths})
    for (CreasePath& path : *paths)
      std::ranges::lower_bound(sheets_.paths, path.curve, {}, &CreasePath::curve)->vertices = std::move(path.vertices);
  VolumeMesh& mesh = sheets_.mesh;
  for (std::size_t i = 0; i < patched.mesh.num_cells(); ++i) {
    if (i < body.cells.size()) {
      std::ranges::copy(patched.mesh.cell(i),
                        mesh.cell_vertices.begin() + static_cast<std::ptrdiff_t>(mesh.cell_offsets[body.cells[i]]));
    } else {
      mesh.add_cell(patched.mesh.kinds[i], patched.mesh.cell(i));
      mesh.references.push_back(patched.mesh.references[i]);
    }
  }
  mesh.positions = std::move(patched.mesh.positions);
  sheets_.fitted = std::move(patched.fitted);
}

/// Returns false if some sheet cannot be padded.
bool SheetPadding::run() {
  return pad_all() && std::ranges::all_of(all_, [&](int reference) { return pad_region(reference); });
}

}  // namespace

std::optional<std::size_t> pad_sheets(PatchedSheets& sheets, const RegionSurface& target, const FeatureCurves& curves) {
  PatchedSheets padded = sheets;
  SheetPadding padding(padded, target, curves);
  if (!padding.run()) return std::nullopt;
  sheets = std::move(padded);
  return padding.num_pads();
}

}  // namespace subvol::internal
