// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/subdivision/limit_surface.h"

#include "subvol/base/error.h"
#include "subvol/subdivision/limit_masks.h"
#include "subvol/subdivision/surface_refinement.h"
#include "subvol/surface/sheets.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <numeric>

namespace subvol {

using namespace internal;

namespace {

constexpr int kMaxBoundaryLevels = 8;  // of refining: 65536 quads from one
constexpr BoundaryRule kRule = BoundaryRule::catmull_clark;

/// An edge that leaves a vertex, and the face between it and the next edge; kNoIndex: there is none, at the border.
struct Spoke {
  Index edge, neighbor, face;
};

/// Returns the spokes of a vertex, counter-clockwise.
std::vector<Spoke> spokes_of(const SurfaceTopology& surface, Index v) {
  std::vector<Spoke> spokes;
  visit_ring(surface, v, [&](int, Index edge, Index neighbor, Index face) {
    spokes.push_back({edge, neighbor, face});
  });
  return spokes;
}

RingSharpness ring_sharpness(const SurfaceTopology& surface, Index v, std::span<const Spoke> spokes) {
  RingSharpness ring{surface.vertex_sharpness[v], {}};
  for (const Spoke& spoke : spokes) ring.edges.push_back(surface.edge_sharpness[spoke.edge]);
  return ring;
}

bool all_quads(const SurfaceTopology& surface, std::span<const Spoke> spokes) {
  return std::all_of(spokes.begin(), spokes.end(),
                     [&](const Spoke& spoke) { return spoke.face == kNoIndex || surface.face_size(spoke.face) == 4; });
}

/// Turns ring masks of a vertex into rows: directly if all its faces are quads, otherwise through its children, whose
/// faces are. The missing face of an open fan lies between two sharp edges, so that no mask of the fan's faces has a
/// weight for it.
class RingRow {
 public:
  RingRow(const SurfaceTopology& surface, Index v, std::span<const Index> columns)
      : surface_(surface),
        vertex_(v),
        columns_(columns),
        spokes_(spokes_of(surface, v)),
        direct_(all_quads(surface, spokes_)),
        sharpness_(ring_sharpness(surface, v, spokes_)) {
    if (direct_) return;
    sharpness_.corner = child_sharpness(sharpness_.corner);
    for (float& s : sharpness_.edges) s = child_sharpness(s);
  }

  const RingSharpness& sharpness() const { return sharpness_; }
  std::span<const Spoke> spokes() const { return spokes_; }

  void add(const RingMask& mask, RowBuilder& row) const {
    const std::size_t n = spokes_.size();
    if (mask[0] != 0) add_vertex(mask[0], row);
    for (std::size_t i = 0; i < n; ++i) {
      if (mask[1 + i] != 0) add_edge(spokes_[i], mask[1 + i], row);
      if (mask[1 + n + i] != 0 && spokes_[i].face != kNoIndex) add_face(spokes_[i].face, mask[1 + n + i], row);
    }
  }

 private:
  void add_vertex(double weight, RowBuilder& row) const {
    if (direct_)
      row.add(columns_[vertex_], weight);
    else
      add_vertex_child(surface_, vertex_, {kRule, columns_, row, weight});
  }
  void add_edge(const Spoke& spoke, double weight, RowBuilder& row) const {
    if (direct_)
      row.add(columns_[spoke.neighbor], weight);
    else
      add_edge_child(surface_, spoke.edge, {kRule, columns_, row, weight});
  }
  void add_face(Index f, double weight, RowBuilder& row) const {
    if (direct_)
      row.add(columns_[opposite(f)], weight);
    else
      add_face_child(surface_, f, {kRule, columns_, row, weight});
  }
  /// Returns the corner of a quad opposite to the vertex.
  Index opposite(Index f) const {
    const auto face = surface_.face(f);
    return face[(std::find(face.begin(), face.end(), vertex_) - face.begin() + 2) % 4];
  }

  const SurfaceTopology& surface_;
  Index vertex_;
  std::span<const Index> columns_;
  std::vector<Spoke> spokes_;
  bool direct_;
  RingSharpness sharpness_;
};

void add_limit_row(const SurfaceTopology& surface, Index v, std::span<const Index> columns, RowBuilder& row) {
  const RingRow ring(surface, v, columns);
  ring.add(limit_mask(ring.sharpness()), row);
}

/// Returns the rows of limit positions; surface vertex v is column columns[v].
SparseMap limit_rows(const SurfaceTopology& surface, std::span<const Index> columns, std::size_t num_cols) {
  return assemble_rows(surface.num_vertices(), num_cols, [&](std::size_t v, RowBuilder& row) {
    add_limit_row(surface, static_cast<Index>(v), columns, row);
  });
}

std::vector<Index> iota(std::size_t n) {
  std::vector<Index> numbers(n);
  std::iota(numbers.begin(), numbers.end(), 0);
  return numbers;
}

/// Appends the row under construction to a map.
void append_row(SparseMap& map, RowBuilder& row) {
  row.flush(map.columns, map.values);
  map.offsets.push_back(map.columns.size());
}

struct Tangents {
  SparseMap u, v;
  std::vector<Index> corner_sites;
};

Tangents tangent_rows(const SurfaceTopology& surface, std::span<const Index> columns, std::size_t num_cols) {
  Tangents tangents;
  tangents.u.num_cols = tangents.v.num_cols = num_cols;
  tangents.corner_sites.resize(surface.corner_vertices.size());
  RowBuilder row(num_cols);
  for (std::size_t v = 0; v < surface.num_vertices(); ++v) {
    const RingRow ring(surface, static_cast<Index>(v), columns);
    for (const TangentSector& sector : tangent_sectors(ring.sharpness())) {
      if (ring.spokes()[sector.first].face == kNoIndex) continue;  // beyond the border
      const Index site = static_cast<Index>(tangents.u.num_rows());
      for (int i = 0; i < sector.count; ++i) {
        const Index f = ring.spokes()[(sector.first + i) % ring.spokes().size()].face;
        const auto face = surface.face(f);
        tangents.corner_sites[surface.face_offsets[f] +
                              (std::find(face.begin(), face.end(), static_cast<Index>(v)) - face.begin())] = site;
      }
      const std::array<RingMask, 2> masks = tangent_masks(ring.sharpness(), sector);
      ring.add(masks[0], row);
      append_row(tangents.u, row);
      ring.add(masks[1], row);
      append_row(tangents.v, row);
    }
  }
  return tangents;
}

std::array<Index, 4> face_entries(const SurfaceTopology& surface, Index f, std::span<const Index> of_corner) {
  std::array<Index, 4> entries = {kNoIndex, kNoIndex, kNoIndex, kNoIndex};
  for (int i = 0; i < surface.face_size(f); ++i) entries[i] = of_corner[surface.face_offsets[f] + i];
  return entries;
}

/// Returns the 2^levels descendants of every crease. Those of edge e have the numbers from e 2^levels on, as
/// `refined_topology` numbers them.
std::vector<std::array<Index, 2>> refined_creases(const VolumeMesh& mesh, const MeshTopology& topology,
                                                  std::span<const Index> volume_edges, const SurfaceTopology& refined,
                                                  int levels) {
  std::vector<std::array<Index, 2>> creases;
  if (mesh.tags.creases.empty()) return creases;
  std::vector<Index> surface_edge(topology.num_edges(), kNoIndex);
  for (std::size_t e = volume_edges.size(); e-- > 0;) surface_edge[volume_edges[e]] = static_cast<Index>(e);
  for (const CreaseEdge& crease : mesh.tags.creases) {
    const Index edge = surface_edge[topology.find_edge(crease.v0, crease.v1)];
    if (edge == kNoIndex) continue;  // on an interface, if only the boundary is refined
    const Index first = edge << levels;
    for (Index e = first; e < first + (Index{1} << levels); ++e) {
      const Index h = refined.edge_corners[e];
      creases.push_back({refined.corner_vertices[h], refined.corner_vertices[refined.next(h)]});
    }
  }
  return creases;
}

}  // namespace

SparseMap limit_map(const VolumeMesh& mesh) {
  const SheetSurface sheets = tagged_sheets(mesh, MeshTopology(mesh));
  std::vector<Index> surface_vertex(mesh.num_vertices(), kNoIndex);
  for (std::size_t i = sheets.vertices.size(); i-- > 0;)  // copies of a vertex have the same row
    surface_vertex[sheets.vertices[i]] = static_cast<Index>(i);
  return assemble_rows(mesh.num_vertices(), mesh.num_vertices(), [&](std::size_t i, RowBuilder& row) {
    if (surface_vertex[i] == kNoIndex)
      row.add(static_cast<Index>(i), 1);
    else
      add_limit_row(sheets.topology, surface_vertex[i], sheets.vertices, row);
  });
}

namespace {

BoundaryRefinement refine(const VolumeMesh& mesh, const MeshTopology& topology, BoundarySurface boundary, int levels,
                          bool with_tangents) {
  if (levels < 0 || levels > kMaxBoundaryLevels)
    throw InputError("refine_boundary: levels must be 0 to " + std::to_string(kMaxBoundaryLevels) + ", got " +
                     std::to_string(levels));
  SurfaceTopology surface = std::move(boundary.topology);
  std::vector<Index> columns = boundary.vertices;
  std::size_t num_cols = mesh.num_vertices();

  BoundaryRefinement result;
  result.vertices = boundary.vertices;
  result.faces = boundary.faces;
  result.face_of_quad = iota(surface.num_faces());
  SparseMap refined;  // children of the last level x control vertices; empty at level 0
  for (int level = 0; level < levels; ++level) {
    SparseMap rows = refinement_rows(surface, kRule, columns, num_cols);
    refined = level == 0 ? std::move(rows) : compose(rows, refined);
    std::vector<Index> parents(surface.corner_faces.size());
    for (std::size_t h = 0; h < parents.size(); ++h) parents[h] = result.face_of_quad[surface.corner_faces[h]];
    result.face_of_quad = std::move(parents);
    surface = refined_topology(surface);
    num_cols = surface.num_vertices();
    columns = iota(num_cols);
  }
  const auto to_control = [&](SparseMap rows) { return levels == 0 ? std::move(rows) : compose(rows, refined); };
  result.positions = to_control(limit_rows(surface, columns, num_cols));
  for (std::size_t f = 0; f < surface.num_faces(); ++f)
    result.quads.push_back(face_entries(surface, static_cast<Index>(f), surface.corner_vertices));
  result.crease_edges = refined_creases(mesh, topology, boundary.edges, surface, levels);
  if (!with_tangents) return result;

  Tangents tangents = tangent_rows(surface, columns, num_cols);
  result.tangent_u = to_control(std::move(tangents.u));
  result.tangent_v = to_control(std::move(tangents.v));
  for (std::size_t f = 0; f < surface.num_faces(); ++f)
    result.quad_sites.push_back(face_entries(surface, static_cast<Index>(f), tangents.corner_sites));
  return result;
}

}  // namespace

BoundaryRefinement refine_boundary(const VolumeMesh& mesh, int levels, bool with_tangents) {
  const MeshTopology topology(mesh);
  return refine(mesh, topology, tagged_boundary(mesh, topology), levels, with_tangents);
}

BoundaryRefinement refine_sheets(const VolumeMesh& mesh, int levels, bool with_tangents) {
  const MeshTopology topology(mesh);
  return refine(mesh, topology, tagged_sheets(mesh, topology), levels, with_tangents);
}

std::vector<Vec3> limit_normals(const BoundaryRefinement& refinement, std::span<const Vec3> control,
                                std::span<const Vec3> points) {
  if (refinement.quad_sites.size() != refinement.quads.size())
    throw InputError("limit_normals: refinement was made without tangents");
  if (points.size() != refinement.positions.num_rows())
    throw InputError("limit_normals: points must be positions.apply(control)");
  const std::vector<Vec3> u = refinement.tangent_u.apply(control), v = refinement.tangent_v.apply(control);
  std::vector<Vec3> facets(u.size(), Vec3::Zero());
  for (std::size_t q = 0; q < refinement.quads.size(); ++q) {
    const auto& quad = refinement.quads[q];
    const int size = quad[3] == kNoIndex ? 3 : 4;
    for (int i = 0; i < size; ++i) {
      const Vec3& p = points[quad[i]];
      facets[refinement.quad_sites[q][i]] +=
          (points[quad[(i + 1) % size]] - p).cross(points[quad[(i + size - 1) % size]] - p);
    }
  }
  // Tangents this close to parallel define no normal: a hundred times the rounding error of their rows.
  constexpr double kParallelTangentSine = 1e-10;
  std::vector<Vec3> normals(u.size());
  for (std::size_t s = 0; s < u.size(); ++s) {
    const Vec3 cross = u[s].cross(v[s]);
    if (cross.norm() <= kParallelTangentSine * u[s].norm() * v[s].norm())
      normals[s] = facets[s].normalized();
    else
      normals[s] = cross.dot(facets[s]) < 0 ? Vec3(-cross.normalized()) : Vec3(cross.normalized());
  }
  return normals;
}

}  // namespace subvol
