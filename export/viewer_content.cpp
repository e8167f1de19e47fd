// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/export/viewer_content.h"

#include "subvol/base/error.h"
#include "subvol/export/export.h"
#include "subvol/export/tessellate.h"
#include "subvol/surface/boundary.h"

#include <algorithm>

namespace subvol::internal {
namespace {

/// Kinds of cells of surfaces, after those of CellKind.
constexpr std::uint8_t kViewerTriangleKind = kNumCellKinds, kViewerQuadKind = kViewerTriangleKind + 1;

/// Evaluates a cell's map at points in canonical coordinates.
class CellMap {
 public:
  CellMap(const HighOrderMesh& mesh, std::size_t c)
      : mesh_(mesh), c_(c), shapes_(mesh.space.kind(c), mesh.space.basis(), mesh.space.max_order()) {}

  Vec3 operator()(const Vec3& point) {
    shapes_.set_point(point);
    const ElementSpace& space = mesh_.space;
    const auto modes = space.modes(c_);
    const auto nodes = space.nodes(c_);
    const auto signs = space.signs(c_);
    Vec3 position = Vec3::Zero();
    for (std::size_t a = 0; a < modes.size(); ++a)
      position += signs[a] * shapes_.value(modes[a]) * mesh_.coefficients[nodes[a]];
    return position;
  }

  /// Canonical coordinates of one of the cell's vertices.
  Vec3 corner(Index vertex) const {
    const auto vertices = mesh_.space.vertices(c_);
    const auto place = std::find(vertices.begin(), vertices.end(), vertex) - vertices.begin();
    return canonical_vertices(mesh_.space.kind(c_))[static_cast<std::size_t>(place)];
  }

 private:
  const HighOrderMesh& mesh_;
  std::size_t c_;
  ShapeFunctions shapes_;
};

std::size_t inner_points(bool is_quad, int n) {
  return static_cast<std::size_t>(is_quad ? (n - 1) * (n - 1) : (n - 1) * (n - 2) / 2);
}

/// Any cell of each edge.
std::vector<Index> cells_of_edges(const MeshTopology& topology) {
  std::vector<Index> cells(topology.num_edges(), 0);
  for (std::size_t c = topology.num_cells(); c-- > 0;)
    for (const Index e : topology.cell_edges(c)) cells[e] = static_cast<Index>(c);
  return cells;
}

/// Writes the points inside an edge.
void sample_edge(const HighOrderMesh& mesh, std::size_t e, std::size_t c, int n, Vec3* points) {
  CellMap map(mesh, c);
  const auto& [a, b] = mesh.space.topology().edge(static_cast<Index>(e));
  const Vec3 from = map.corner(a), to = map.corner(b);
  for (int i = 1; i < n; ++i) *points++ = map(from + (to - from) * i / n);
}

/// Writes the points inside a face, in its own frame.
void sample_face(const HighOrderMesh& mesh, std::size_t f, int n, Vec3* points) {
  CellMap map(mesh, static_cast<std::size_t>(mesh.space.topology().face_cells(static_cast<Index>(f))[0]));
  const std::array<Index, 4>& frame = mesh.space.face_frame(f);
  const bool is_quad = frame[3] != kNoIndex;
  const Vec3 origin = map.corner(frame[0]), along = map.corner(frame[1]) - origin,
             across = map.corner(is_quad ? frame[3] : frame[2]) - origin;
  for (int j = 1; j < n; ++j)
    for (int i = 1; is_quad ? i < n : i + j < n; ++i) *points++ = map(origin + along * i / n + across * j / n);
}

}  // namespace

int viewer_intervals(const HighOrderMesh& mesh, std::size_t most_points) {
  const int order = mesh.space.max_order();
  if (order == 1) return 1;
  constexpr int kMostViewerIntervals = 10;  // a picture shows no more of a cell
  const MeshTopology& topology = mesh.space.topology();
  int n = std::min(2 * order, kMostViewerIntervals);
  const auto points = [&] {
    return topology.num_edges() * static_cast<std::size_t>(n - 1) + topology.num_faces() * inner_points(true, n);
  };
  while (n > 2 && points() > most_points) --n;
  return n;
}

ViewerMesh viewer_mesh(std::string name, const VolumeMesh& mesh) {
  ViewerMesh result{.name = std::move(name), .num_vertices = mesh.num_vertices(), .points = mesh.positions};
  for (const CellKind kind : mesh.kinds) result.kinds.push_back(static_cast<std::uint8_t>(kind));
  result.corners = mesh.cell_vertices;
  return result;
}

ViewerMesh viewer_mesh(std::string name, const HighOrderMesh& mesh, int intervals) {
  if (intervals < 1) throw InputError("viewer_mesh: expected at least one interval per edge");
  ViewerMesh result = viewer_mesh(std::move(name), mesh.straight_sided());
  result.intervals = intervals;
  if (intervals == 1) return result;
  const MeshTopology& topology = mesh.space.topology();
  const int n = intervals;
  const auto per_edge = static_cast<std::size_t>(n - 1);
  const std::size_t num_edges = topology.num_edges(), num_faces = topology.num_faces();
  result.num_edges = num_edges;
  for (std::size_t c = 0; c < topology.num_cells(); ++c) {
    const auto edges = topology.cell_edges(c), faces = topology.cell_faces(c);
    result.edges.insert(result.edges.end(), edges.begin(), edges.end());
    result.faces.insert(result.faces.end(), faces.begin(), faces.end());
  }
  std::vector<std::size_t> first(num_faces + 1, result.num_vertices + num_edges * per_edge);
  for (std::size_t f = 0; f < num_faces; ++f)
    first[f + 1] = first[f] + inner_points(topology.face(static_cast<Index>(f)).size() == 4, n);
  result.points.resize(first[num_faces]);
  const std::vector<Index> edge_cells = cells_of_edges(topology);
#pragma omp parallel
  {
#pragma omp for schedule(dynamic, 64)
    for (std::size_t e = 0; e < num_edges; ++e)
      sample_edge(mesh, e, static_cast<std::size_t>(edge_cells[e]), n,
                  &result.points[result.num_vertices + e * per_edge]);
#pragma omp for schedule(dynamic, 64)
    for (std::size_t f = 0; f < num_faces; ++f)
      if (first[f + 1] > first[f]) sample_face(mesh, f, n, &result.points[first[f]]);
  }
  return result;
}

ViewerMesh viewer_mesh(std::string name, const PolygonMesh& mesh) {
  for (std::size_t f = 0; f < mesh.num_faces(); ++f)
    if (const std::size_t size = mesh.face_offsets[f + 1] - mesh.face_offsets[f]; size < 3 || size > 4)
      return viewer_mesh(std::move(name), as_polygons(triangulate(mesh)));
  ViewerMesh result{.name = std::move(name), .num_vertices = mesh.positions.size(), .points = mesh.positions};
  for (std::size_t f = 0; f < mesh.num_faces(); ++f)
    result.kinds.push_back(mesh.face_offsets[f + 1] - mesh.face_offsets[f] == 4 ? kViewerQuadKind
                                                                                : kViewerTriangleKind);
  result.corners = mesh.face_vertices;
  if (mesh.face_groups.empty()) return result;
  ViewerField groups{.name = "group", .label = "Group", .colors = ViewerField::Colors::regions};
  for (const Index group : mesh.face_groups.of_face)
    groups.values.push_back(static_cast<float>(group == kNoIndex ? 0 : mesh.face_groups.groups[group].number));
  for (const Group& group : mesh.face_groups.groups) groups.region_names.emplace_back(group.number, label_of(group));
  result.fields.push_back(std::move(groups));
  return result;
}

ViewerSurface viewer_surface(const TriangleMesh& mesh) {
  return {.points = mesh.positions, .triangles = mesh.triangles};
}

ViewerSurface viewer_wires(const VolumeMesh& mesh) {
  const MeshTopology topology(mesh);
  ViewerSurface result{.points = mesh.positions};
  for (std::size_t e = 0; e < topology.num_edges(); ++e)
    if (topology.is_boundary_edge(static_cast<Index>(e))) result.wires.push_back(topology.edge(static_cast<Index>(e)));
  return result;
}

ViewerSurface viewer_limit(const VolumeMesh& cage, std::span<const double> finest_cell_minima, double max_chord_error) {
  const TessellatedSurface surface = tessellate(cage, max_chord_error);
  ViewerSurface result{.points = surface.positions, .wires = surface.wireframe};
  const std::vector<double> quality =
      finest_cell_minima.empty() ? std::vector<double>() : patch_quality(cage, surface, finest_cell_minima);
  if (!quality.empty()) result.values.assign(surface.positions.size(), 1.0f);
  for (std::size_t q = 0; q < surface.quads.size(); ++q) {
    const auto& [a, b, c, d] = surface.quads[q];
    result.triangles.push_back({a, b, c});
    result.triangles.push_back({a, c, d});
    if (quality.empty()) continue;
    for (const Index v : {a, b, c, d})
      result.values[v] = std::min(result.values[v], static_cast<float>(quality[surface.quad_patches[q]]));
  }
  return result;
}

}  // namespace subvol::internal
