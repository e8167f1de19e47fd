// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/export/cutaway.h"

#include "subvol/base/error.h"
#include "subvol/export/color_map.h"
#include "subvol/fit/elements/boundary_samples.h"
#include "subvol/surface/boundary.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <map>
#include <set>
#include <utility>

namespace subvol {
namespace {

constexpr const char* kRegionColorMap = "viridis, one color for each region";

/// Visible faces, by their numbers in MeshTopology, and the cells behind them.
struct SeenFaces {
  std::vector<Index> faces, cells;
};

Vec3 center(const HighOrderMesh& mesh, std::size_t c) {
  Vec3 sum = Vec3::Zero();
  for (const Index v : mesh.space.vertices(c)) sum += mesh.coefficients[v];
  return sum / static_cast<double>(mesh.space.vertices(c).size());
}

/// Returns for each cell whether it stays: true if its center lies up to the plane.
std::vector<char> kept_cells(const HighOrderMesh& mesh, const CutPlane& plane) {
  constexpr double kLayerCenterTolerance = 1e-9;  // share of the extent by which the centers of one layer may differ
  Eigen::AlignedBox3d box, centers;
  for (std::size_t v = 0; v < mesh.space.num_vertices(); ++v) box.extend(mesh.coefficients[v]);
  for (std::size_t c = 0; c < mesh.space.num_cells(); ++c) centers.extend(center(mesh, c));
  int axis = plane.axis;
  if (axis == CutPlane::kShortestAxis) box.sizes().minCoeff(&axis);
  const double place =
      centers.min()[axis] + plane.share * centers.sizes()[axis] + kLayerCenterTolerance * box.sizes()[axis];
  std::vector<char> kept;
  for (std::size_t c = 0; c < mesh.space.num_cells(); ++c) kept.push_back(center(mesh, c)[axis] <= place ? 1 : 0);
  return kept;
}

/// Samples of faces as separate polygons, oriented to face out of the cells behind them.
PolygonMesh polygons_of(const BoundarySamples& samples, const HighOrderMesh& mesh, const SeenFaces& seen) {
  const MeshTopology& topology = mesh.space.topology();
  std::vector<char> turned(topology.num_faces(), 0);
  for (std::size_t i = 0; i < seen.faces.size(); ++i)
    turned[seen.faces[i]] = topology.face_cells(seen.faces[i])[0] != seen.cells[i];
  TriangleMesh triangles{samples.positions.apply(mesh.coefficients), samples.triangles};
  for (std::size_t t = 0; t < triangles.triangles.size(); ++t)
    if (turned[samples.triangle_faces[t]]) std::swap(triangles.triangles[t][1], triangles.triangles[t][2]);
  return as_polygons(triangles);
}

/// Gives polygons with different keys, faces or regions, vertices of their own, appended to the existing ones, so that
/// colors end where keys change.
void part(PolygonMesh& mesh, const std::vector<Index>& keys) {
  std::map<std::pair<Index, Index>, Index> copies;  // of a vertex for a key
  for (std::size_t p = 0; p < mesh.num_faces(); ++p)
    for (std::size_t k = mesh.face_offsets[p]; k < mesh.face_offsets[p + 1]; ++k) {
      const Index v = mesh.face_vertices[k];
      const auto [at, is_new] = copies.try_emplace({v, keys[p]}, static_cast<Index>(mesh.positions.size()));
      if (is_new) mesh.positions.push_back(mesh.positions[v]);
      mesh.face_vertices[k] = at->second;
    }
}

/// The least value of the polygons around each vertex.
std::vector<double> at_vertices(const PolygonMesh& mesh, const std::vector<Index>& polygon_faces,
                                const std::vector<double>& face_values) {
  std::vector<double> values(mesh.positions.size(), 1);
  for (std::size_t p = 0; p < mesh.num_faces(); ++p)
    for (std::size_t k = mesh.face_offsets[p]; k < mesh.face_offsets[p + 1]; ++k)
      values[mesh.face_vertices[k]] = std::min(values[mesh.face_vertices[k]], face_values[polygon_faces[p]]);
  return values;
}

/// A shade per vertex that tells regions apart, evenly spaced in [0, 1].
std::vector<double> region_shades(const PolygonMesh& mesh, const std::vector<Index>& region_of_polygon,
                                  std::size_t num_regions) {
  std::vector<double> shades(mesh.positions.size(), 1);
  for (std::size_t p = 0; p < mesh.num_faces(); ++p)
    for (std::size_t k = mesh.face_offsets[p]; k < mesh.face_offsets[p + 1]; ++k)
      shades[mesh.face_vertices[k]] =
          (static_cast<double>(region_of_polygon[p]) + 0.5) / static_cast<double>(num_regions);
  return shades;
}

/// The edges of faces that are not among `drawn` yet.
std::vector<Index> new_edges(const MeshTopology& topology, const std::vector<Index>& faces, std::set<Index>& drawn) {
  std::vector<Index> edges;
  for (const Index f : faces) {
    const auto corners = topology.face(f);
    for (std::size_t k = 0; k < corners.size(); ++k) {
      const Index edge = topology.find_edge(corners[k], corners[(k + 1) % corners.size()]);
      if (drawn.insert(edge).second) edges.push_back(edge);
    }
  }
  return edges;
}

int intervals_of(const ElementSpace& space) {
  constexpr int kLeastCutawayIntervals = 4, kCutawayIntervalsPerOrder = 2;
  return space.max_order() == 1 ? 1 : std::max(kLeastCutawayIntervals, kCutawayIntervalsPerOrder * space.max_order());
}

}  // namespace

Scene cutaway_scene(const HighOrderMesh& mesh, std::span<const double> cell_minima, const CutPlane& plane,
                    const SurfaceSceneOptions& options, const CellRegions& regions) {
  const MeshTopology& topology = mesh.space.topology();
  if (mesh.space.num_cells() == 0) throw InputError("cutaway: expected a mesh with cells");
  if (cell_minima.size() != mesh.space.num_cells()) throw InputError("cell_minima: expected one value per cell");
  if (plane.axis < CutPlane::kShortestAxis || plane.axis > 2) throw InputError("CutPlane::axis: expected 0, 1 or 2");
  if (!(plane.share > 0 && plane.share < 1)) throw InputError("CutPlane::share: expected a number between 0 and 1");
  const bool shows_regions = regions.regions.size() > 1;
  if (shows_regions && regions.of_cell.size() != mesh.space.num_cells())
    throw InputError("CellRegions::of_cell: expected one region per cell");

  const std::vector<char> kept = kept_cells(mesh, plane);
  std::array<SeenFaces, 2> seen;  // of the surface and of the cut
  std::vector<double> face_quality(topology.num_faces(), 1);
  std::vector<Index> face_region(topology.num_faces(), 0);
  for (std::size_t i = 0; i < topology.num_faces(); ++i) {
    const auto f = static_cast<Index>(i);
    const auto [first, second] = topology.face_cells(f);
    const bool has_first = kept[first] != 0, has_second = second != kNoIndex && kept[second] != 0;
    if (has_first == has_second) continue;
    SeenFaces& list = seen[topology.is_boundary_face(f) ? 0 : 1];
    list.faces.push_back(f);
    list.cells.push_back(has_first ? first : second);
    face_quality[i] = cell_minima[list.cells.back()];
    if (shows_regions) face_region[i] = regions.of_cell[list.cells.back()];
  }

  std::vector<SceneSheet> sheets;
  std::set<Index> drawn;
  for (const char* name : {"surface", "cut"}) {
    const SeenFaces& faces = seen[sheets.size()];
    if (faces.faces.empty()) continue;
    const BoundarySamples samples =
        make_face_samples(mesh.space, faces.faces, intervals_of(mesh.space), new_edges(topology, faces.faces, drawn));
    const bool is_cut = !sheets.empty();
    SceneSheet& sheet = sheets.emplace_back();
    sheet.name = name;
    sheet.mesh = polygons_of(samples, mesh, faces);
    std::vector<Index> region_of_polygon;
    for (const Index f : samples.triangle_faces) region_of_polygon.push_back(face_region[f]);
    if (is_cut)
      part(sheet.mesh, samples.triangle_faces);
    else if (shows_regions)
      part(sheet.mesh, region_of_polygon);
    sheet.shades = at_vertices(sheet.mesh, samples.triangle_faces, face_quality);
    sheet.attribute = {"_SCALED_JACOBIAN", sheet.shades};
    sheet.wires = samples.crease_edges;
    if (!shows_regions) continue;
    sheet.shades = region_shades(sheet.mesh, region_of_polygon, regions.regions.size());
    sheet.mesh.face_groups = {regions.regions, std::move(region_of_polygon)};
  }
  return sheet_scene(sheets, shows_regions ? kRegionColorMap : kQualityColorMap, options);
}

Scene cutaway_scene(const VolumeMesh& mesh, std::span<const double> cell_minima, const CutPlane& plane,
                    const SurfaceSceneOptions& options, const CellRegions& regions) {
  return cutaway_scene(HighOrderMesh(ElementSpace(mesh, Basis::legendre, 1), mesh), cell_minima, plane, options,
                       regions);
}

}  // namespace subvol
