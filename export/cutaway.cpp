// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/export/cutaway.h"

#include "subvol/base/error.h"
#include "subvol/export/color_map.h"
#include "subvol/fit/elements/boundary_samples.h"
#include "subvol/surface/boundary.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <set>
#include <utility>

namespace subvol {
namespace {

/// Visible faces, by their numbers in MeshTopology, and the cells behind them.
struct SeenFaces {
  std::vector<Index> faces, cells;
};

Vec3 centre(const HighOrderMesh& mesh, std::size_t c) {
  Vec3 sum = Vec3::Zero();
  for (const Index v : mesh.space.vertices(c)) sum += mesh.coefficients[v];
  return sum / static_cast<double>(mesh.space.vertices(c).size());
}

/// Returns for each cell whether it stays: true if its center lies up to the plane.
std::vector<char> kept_cells(const HighOrderMesh& mesh, const CutPlane& plane) {
  constexpr double kRounding = 1e-9;  // share of the extent by which the centers of one layer may differ
  Eigen::AlignedBox3d box, centres;
  for (std::size_t v = 0; v < mesh.space.num_vertices(); ++v) box.extend(mesh.coefficients[v]);
  for (std::size_t c = 0; c < mesh.space.num_cells(); ++c) centres.extend(centre(mesh, c));
  int axis = plane.axis;
  if (axis == CutPlane::kShortest) box.sizes().minCoeff(&axis);
  const double place =
      centres.min()[axis] + plane.share * centres.sizes()[axis] + kRounding * box.sizes()[axis];
  std::vector<char> kept;
  for (std::size_t c = 0; c < mesh.space.num_cells(); ++c) kept.push_back(centre(mesh, c)[axis] <= place ? 1 : 0);
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

/// Gives every face its own vertices, appended to the existing ones, so that colors end at the edges of faces.
void part_faces(PolygonMesh& mesh, const std::vector<Index>& polygon_faces) {
  std::vector<Index> copy(mesh.positions.size(), kNoIndex), face_of_copy(mesh.positions.size(), kNoIndex);
  for (std::size_t p = 0; p < mesh.num_faces(); ++p)
    for (std::size_t k = mesh.face_offsets[p]; k < mesh.face_offsets[p + 1]; ++k) {
      const Index v = mesh.face_vertices[k];
      if (face_of_copy[v] != polygon_faces[p]) {
        face_of_copy[v] = polygon_faces[p];
        copy[v] = static_cast<Index>(mesh.positions.size());
        mesh.positions.push_back(mesh.positions[v]);
      }
      mesh.face_vertices[k] = copy[v];
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
  constexpr int kLeastIntervals = 4, kIntervalsPerOrder = 2;
  return space.max_order() == 1 ? 1 : std::max(kLeastIntervals, kIntervalsPerOrder * space.max_order());
}

}  // namespace

Scene cutaway_scene(const HighOrderMesh& mesh, std::span<const double> cell_minima, const CutPlane& plane,
                    const SurfaceSceneOptions& options) {
  const MeshTopology& topology = mesh.space.topology();
  if (mesh.space.num_cells() == 0) throw InputError("cutaway: expected a mesh with cells");
  if (cell_minima.size() != mesh.space.num_cells()) throw InputError("cell_minima: expected one value per cell");
  if (plane.axis < CutPlane::kShortest || plane.axis > 2) throw InputError("CutPlane::axis: expected 0, 1 or 2");
  if (!(plane.share > 0 && plane.share < 1)) throw InputError("CutPlane::share: expected a number between 0 and 1");

  const std::vector<char> kept = kept_cells(mesh, plane);
  std::array<SeenFaces, 2> seen;  // of the surface and of the cut
  std::vector<double> face_quality(topology.num_faces(), 1);
  for (std::size_t i = 0; i < topology.num_faces(); ++i) {
    const auto f = static_cast<Index>(i);
    const auto [first, second] = topology.face_cells(f);
    const bool has_first = kept[first] != 0, has_second = second != kNoIndex && kept[second] != 0;
    if (has_first == has_second) continue;
    SeenFaces& list = seen[topology.is_boundary_face(f) ? 0 : 1];
    list.faces.push_back(f);
    list.cells.push_back(has_first ? first : second);
    face_quality[i] = cell_minima[list.cells.back()];
  }

  std::vector<SceneSheet> sheets;
  std::set<Index> drawn;
  for (const char* name : {"surface", "cut"}) {
    const SeenFaces& faces = seen[sheets.size()];
    if (faces.faces.empty()) continue;
    const BoundarySamples samples = make_face_samples(mesh.space, faces.faces, intervals_of(mesh.space),
                                                      new_edges(topology, faces.faces, drawn));
    const bool is_cut = !sheets.empty();
    SceneSheet& sheet = sheets.emplace_back();
    sheet.name = name;
    sheet.mesh = polygons_of(samples, mesh, faces);
    if (is_cut) part_faces(sheet.mesh, samples.triangle_faces);
    sheet.shades = at_vertices(sheet.mesh, samples.triangle_faces, face_quality);
    sheet.attribute = {"_SCALED_JACOBIAN", sheet.shades};
    sheet.wires = samples.crease_edges;
  }
  return sheet_scene(sheets, kQualityColorMap, options);
}

Scene cutaway_scene(const VolumeMesh& mesh, std::span<const double> cell_minima, const CutPlane& plane,
                    const SurfaceSceneOptions& options) {
  return cutaway_scene(HighOrderMesh(ElementSpace(mesh, Basis::legendre, 1), mesh), cell_minima, plane, options);
}

}  // namespace subvol
