// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/features/pads.h"

#include "subvol/base/error.h"
#include "subvol/fit/features/patch_fans.h"
#include "subvol/mesh/validate.h"
#include "subvol/surface/triangle_geometry.h"
#include "subvol/templates/template_edit.h"

#include <algorithm>
#include <array>
#include <limits>
#include <string>
#include <utility>

namespace subvol::internal {

namespace {

/// Depth of a pad in units of the shortest edge. Three perpendicular steps of a corner stay clear of the opposite
/// edges.
constexpr double kDepth = 0.2;
/// Cosine above which two faces count as one plane: those of a grid are along its axes.
constexpr double kSamePlaneCosine = 0.9;
constexpr int kShortenings = 20;  // halvings of a step: 1e-6 of it is none

using CellFaces = std::array<Index, kMaxCellFaces>;  ///< something for each local face of a cell

std::vector<std::uint8_t> marked(const PatchedMesh& patched, std::span<const Index> patches) {
  std::vector<std::uint8_t> is_padded(patched.patches.count, 0);
  for (Index p : patches) {
    if (p < 0 || static_cast<std::size_t>(p) >= patched.patches.count)
      throw InputError("pad: there is no patch " + std::to_string(p));
    is_padded[p] = 1;
  }
  return is_padded;
}

std::size_t local_face(const MeshTopology& topology, Index face) {
  const auto faces = topology.cell_faces(topology.face_cells(face)[0]);
  return static_cast<std::size_t>(std::ranges::find(faces, face) - faces.begin());
}

/// One pad in the making.
class PadBuilder {
 public:
  PadBuilder(const PatchedMesh& patched, std::vector<std::uint8_t> is_padded)
      : old_(patched),
        fans_(patched),
        is_padded_(std::move(is_padded)),
        new_vertex_(patched.mesh.num_vertices(), kNoIndex) {}

  std::optional<PadRefusal> refusal() const { return topological_refusal(fans_, old_, is_padded_); }

  /// Returns the padded mesh, or why there is none.
  std::optional<PadRefusal> build(PatchedMesh& result) {
    number_vertices();
    result = old_;
    add_vertices(result);
    move_cells(result.mesh);
    add_cells(result);
    if (const auto inverted = shorten_steps(result.mesh)) return inverted;
    for (CreasePath& path : result.paths) path.vertices = moved_path(path.vertices);
    for (CreasePath& path : result.inner_paths) path.vertices = moved_path(path.vertices);
    move_angles(result);
    move_inner_faces(result);
    return std::nullopt;
  }

 private:
  bool is_padded_face(Index face) const { return is_padded_[old_.patches.of_face[face]] != 0; }
  Index moved(Index v) const { return new_vertex_[v] == kNoIndex ? v : new_vertex_[v]; }
  std::span<const Index> face(Index place) const { return fans_.topology.face(fans_.topology.boundary_faces()[place]); }

  /// True for an edge with a padded face, which keeps its old vertices.
  bool stays(Index v, Index w) const {
    const Index e = fans_.topology.find_edge(v, w);
    return e != kNoIndex && edge_stays_[e] != 0;
  }

  void number_vertices() {
    const auto faces = fans_.topology.boundary_faces();
    edge_stays_.assign(fans_.topology.num_edges(), 0);
    for (std::size_t f = 0; f < faces.size(); ++f) {
      if (!is_padded_face(static_cast<Index>(f))) continue;
      padded_.push_back(static_cast<Index>(f));
      const auto corners = face(static_cast<Index>(f));
      for (std::size_t i = 0; i < corners.size(); ++i) {
        new_vertex_[corners[i]] = 0;
        edge_stays_[fans_.topology.find_edge(corners[i], corners[(i + 1) % corners.size()])] = 1;
      }
    }
    auto next = static_cast<Index>(new_vertex_.size());
    for (std::size_t v = 0; v < new_vertex_.size(); ++v)
      if (new_vertex_[v] != kNoIndex) {
        new_vertex_[v] = next++;
        doubled_.push_back(static_cast<Index>(v));
      }
  }

  std::vector<double> shortest_edges() const {
    std::vector<double> shortest(new_vertex_.size(), std::numeric_limits<double>::infinity());
    for (std::size_t e = 0; e < fans_.topology.num_edges(); ++e) {
      const auto [v, w] = fans_.topology.edge(static_cast<Index>(e));
      const double length = (old_.mesh.positions[v] - old_.mesh.positions[w]).norm();
      shortest[v] = std::min(shortest[v], length);
      shortest[w] = std::min(shortest[w], length);
    }
    return shortest;
  }

  /// Distinct normals of the padded faces at each vertex.
  std::vector<std::vector<Vec3>> distinct_normals() const {
    std::vector<std::vector<Vec3>> normals(new_vertex_.size());
    for (Index f : padded_) {
      const Vec3 n = normal_of_face(old_.mesh.positions, face(f));
      for (Index v : face(f))
        if (std::ranges::none_of(normals[v], [&](const Vec3& m) { return m.dot(n) > kSamePlaneCosine; }))
          normals[v].push_back(n);
    }
    return normals;
  }

  void add_vertices(PatchedMesh& result) const {
    const std::vector<double> shortest = shortest_edges();
    const auto normals = distinct_normals();
    for (Index v : doubled_) {
      Vec3 step = Vec3::Zero();
      for (const Vec3& n : normals[v]) step -= kDepth * shortest[v] * n;
      result.mesh.positions.push_back(old_.mesh.positions[v] + step);
      result.fitted.push_back(old_.fitted[v]);
    }
  }

  void move_cells(VolumeMesh& mesh) const {
    for (Index& v : mesh.cell_vertices) v = moved(v);
  }

  void add_cells(PatchedMesh& result) const {
    const auto faces = fans_.topology.boundary_faces();
    CellFaces none;
    none.fill(kNoIndex);
    std::vector<CellFaces> patch_of(old_.mesh.num_cells(), none);
    for (std::size_t f = 0; f < faces.size(); ++f)
      patch_of[fans_.topology.face_cells(faces[f])[0]][local_face(fans_.topology, faces[f])] = old_.patches.of_face[f];
    std::vector<Index> corners;
    for (Index f : padded_) {
      corners.clear();
      for (Index v : face(f)) corners.push_back(new_vertex_[v]);
      corners.insert(corners.end(), face(f).begin(), face(f).end());
      result.mesh.add_cell(corners.size() == 8 ? CellKind::hex : CellKind::prism, corners);
      if (!old_.mesh.references.empty())
        result.mesh.references.push_back(old_.mesh.references[fans_.topology.face_cells(faces[f])[0]]);
      patch_of.push_back(patches_of_new_cell(f));
    }
    label(result, patch_of);
  }

  /// The outer face of a new cell belongs to the patch, its sides at the border to the patches beyond.
  CellFaces patches_of_new_cell(Index f) const {
    constexpr std::size_t kOuter = 1, kFirstSide = 2;  // of hexes and prisms
    CellFaces patches;
    patches.fill(kNoIndex);
    patches[kOuter] = old_.patches.of_face[f];
    const SurfaceTopology& surface = fans_.surface();
    for (Index i = 0; i < surface.face_size(f); ++i) {
      const Index beyond = surface.corner_faces[surface.twins[surface.face_offsets[f] + i]];
      if (!is_padded_face(beyond)) patches[kFirstSide + i] = old_.patches.of_face[beyond];
    }
    return patches;
  }

  static void label(PatchedMesh& result, std::span<const CellFaces> patch_of) {
    const MeshTopology topology(result.mesh);
    result.patches.of_face.clear();
    for (Index face : topology.boundary_faces())
      result.patches.of_face.push_back(patch_of[topology.face_cells(face)[0]][local_face(topology, face)]);
  }

  /// Halves the steps of the new vertices of inverted cells until there are none.
  std::optional<PadRefusal> shorten_steps(VolumeMesh& mesh) const {
    const auto first_new = static_cast<Index>(new_vertex_.size());
    const auto is_new = [&](Index v) { return v >= first_new; };
    std::vector<std::size_t> cells;
    for (std::size_t c = 0; c < mesh.num_cells(); ++c)
      if (std::ranges::any_of(mesh.cell(c), is_new)) cells.push_back(c);
    for (int round = 0; round <= kShortenings; ++round) {
      std::vector<std::uint8_t> shorten(doubled_.size(), 0);
      Index bad = kNoIndex;
      for (std::size_t c : cells)
        if (!corners_positive(mesh, c))
          for (Index v : mesh.cell(c))
            if (is_new(v)) shorten[v - first_new] = 1, bad = doubled_[v - first_new];
      if (bad == kNoIndex) return std::nullopt;
      if (round == kShortenings) return PadRefusal{PadProblem::inverted, bad};
      for (std::size_t i = 0; i < shorten.size(); ++i) {
        Vec3& p = mesh.positions[new_vertex_[doubled_[i]]];
        if (shorten[i]) p = 0.5 * (p + mesh.positions[doubled_[i]]);
      }
    }
    return std::nullopt;
  }

  /// Returns a path on its old or new vertices, with an edge between both wherever it changes, and from its old ends.
  std::vector<Index> moved_path(std::span<const Index> path) const {
    std::vector<Index> result = {path.front()};
    const auto go_to = [&](Index v) {
      if (result.back() != v) result.push_back(v);
    };
    for (std::size_t i = 0; i + 1 < path.size(); ++i) {
      const bool old = stays(path[i], path[i + 1]);
      go_to(old ? path[i] : moved(path[i]));
      go_to(old ? path[i + 1] : moved(path[i + 1]));
    }
    go_to(path.back());
    return result;
  }

  void move_angles(PatchedMesh& result) const {
    for (EdgeAngle& angle : result.angles) {
      const auto [v, w] = angle.ends;
      if (!stays(v, w)) angle.ends = {std::min(moved(v), moved(w)), std::max(moved(v), moved(w))};
    }
    std::ranges::sort(result.angles, {}, &EdgeAngle::ends);
  }

  /// Adds the sides of new cells at which inner faces end.
  void move_inner_faces(PatchedMesh& result) const {
    for (std::size_t f = 0; f < old_.inner_faces.size(); ++f) {
      const InnerFace& face = old_.inner_faces[f];
      const std::size_t size = face.vertices().size();
      for (std::size_t i = 0; i < size; ++i) {
        const Index v = face.corners[i], w = face.corners[(i + 1) % size];
        if (stays(v, w)) result.inner_faces.push_back({{v, w, moved(w), moved(v)}, face.patch});
        result.inner_faces[f].corners[i] = moved(v);
      }
    }
  }

  const PatchedMesh& old_;
  PatchFans fans_;
  std::vector<std::uint8_t> is_padded_;   ///< by patch
  std::vector<Index> new_vertex_;         ///< of each old vertex; kNoIndex: none
  std::vector<Index> doubled_;            ///< old vertices with a new one, ascending
  std::vector<Index> padded_;             ///< padded faces, as places in `boundary_faces()`
  std::vector<std::uint8_t> edge_stays_;  ///< by old edge
};

}  // namespace

std::string to_string(PadProblem problem) {
  switch (problem) {
    case PadProblem::touches_itself: return "the pad would touch itself";
    case PadProblem::too_many_paths: return "the pad would split a corner";
    case PadProblem::moves_shared: return "the pad would move faces of cells beyond";
    case PadProblem::inverted: return "the pad would invert a cell";
  }
  return "unknown";
}

PatchedMesh patched_mesh(VolumeMesh mesh, std::vector<Vec3> fitted, const FeatureRouting& routing,
                         const TriangleMesh& target) {
  require_valid(mesh, "patched_mesh");
  mesh.tags = {};
  const MeshTopology topology(mesh);
  PatchedMesh patched;
  patched.patches = boundary_patches(topology, routing.paths);
  patched.angles = smooth_edge_angles(topology, routing.paths, fitted, target);
  patched.mesh = std::move(mesh);
  patched.fitted = std::move(fitted);
  patched.paths = routing.paths;
  patched.corners = routing.corners;
  const PatchFans check(patched);
  return patched;
}

std::optional<PadRefusal> pad(PatchedMesh& patched, std::span<const Index> patches) {
  PadBuilder builder(patched, marked(patched, patches));
  if (const auto refusal = builder.refusal()) return refusal;
  PatchedMesh result;
  if (const auto refusal = builder.build(result)) return refusal;
  patched = std::move(result);
  return std::nullopt;
}

}  // namespace subvol::internal
