// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/runs/shell_output.h"

#include "cli/runs/exit_status.h"
#include "subvol/base/format.h"
#include "subvol/export/read_back.h"
#include "subvol/export/volume_writer.h"
#include "subvol/fit/stages/fit_report.h"
#include "subvol/fit/target/soup_topology.h"
#include "subvol/mesh/cell_topology.h"
#include "subvol/surface/boundary.h"
#include "subvol/surface/triangle_geometry.h"
#include "subvol/surface/winding_number.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <numeric>
#include <span>

namespace subvol::cli {

using namespace internal;
namespace {

/// Statistics of the thicknesses of one side, in the mesh's unit.
struct ThicknessFigures {
  double mean = 0, least = 0, most = 0;

  explicit ThicknessFigures(std::span<const double> thickness) {
    for (const double t : thickness) mean += t / static_cast<double>(thickness.size());
    least = *std::min_element(thickness.begin(), thickness.end());
    most = *std::max_element(thickness.begin(), thickness.end());
  }
};

/// Calls visit(name, first strand) for every side that has layers.
template <class Visit>
void for_each_side(const ShellLayers& layers, const Visit& visit) {
  if (layers.inside > 0) visit("inside", std::size_t{0});
  if (layers.outside > 0) visit("outside", layers.num_columns());
}

/// Converts values per strand to values per vertex; a vertex of the surface itself gets the larger value of both sides.
std::vector<double> by_vertex(const ShellLayers& layers, const std::vector<double>& by_strand) {
  const std::size_t n = layers.num_columns();
  std::vector<double> values;
  for (std::size_t i = 0; i < layers.num_sheets() * n; ++i) {
    const Index strand = layers.strand(static_cast<Index>(i));
    values.push_back(strand == kNoIndex ? std::max(by_strand[i % n], by_strand[n + i % n]) : by_strand[strand]);
  }
  return values;
}

/// Fills mesh and wires of a sheet; returns (achieved, asked, 0) thickness at each of the mesh's vertices.
using MakeSheet = std::function<std::vector<Vec3>(int sheet, SceneSheet& made)>;

Scene scene_of(const ShellLayers& layers, const MakeSheet& make, const SurfaceSceneOptions& options) {
  std::vector<SceneSheet> sheets;
  const auto add = [&](const char* name, int sheet) {
    SceneSheet& added = sheets.emplace_back();
    added.name = name;
    added.attribute.name = "_THICKNESS";
    for (const Vec3& thickness : make(sheet, added)) {
      added.attribute.values.push_back(thickness[0]);
      added.shades.push_back(thickness[0] / thickness[1]);
    }
  };
  if (layers.inside > 0) add("inner", 0);
  add("base", layers.inside);
  if (layers.outside > 0) add("outer", layers.num_sheets() - 1);
  return sheet_scene(sheets, "viridis over achieved / asked thickness 0..1, above 1 as 1", options);
}

/// Returns (achieved, asked, 0) thickness at every vertex.
std::vector<Vec3> thickness_at_vertices(const ShellResult& shell) {
  const std::vector<double> achieved = by_vertex(shell.layers, shell.achieved),
                            asked = by_vertex(shell.layers, shell.asked);
  std::vector<Vec3> thickness;
  for (std::size_t v = 0; v < achieved.size(); ++v) thickness.emplace_back(achieved[v], asked[v], 0);
  return thickness;
}

Scene scene_of(const ShellResult& shell, const SurfaceSceneOptions& options) {
  const std::vector<Vec3> thickness = thickness_at_vertices(shell);
  const auto make = [&](int sheet, SceneSheet& made) {
    made.mesh = sheet_surface(shell.layers, shell.mesh, sheet);
    const auto first = thickness.begin() + shell.layers.vertex(sheet, 0);
    return std::vector<Vec3>(first, first + static_cast<std::ptrdiff_t>(shell.layers.num_columns()));
  };
  return scene_of(shell.layers, make, options);
}

/// Sheets of curved cells, sampled; the thickness is interpolated linearly between the vertices.
Scene scene_of(const ShellResult& shell, const CurvedShell& curved, const SurfaceSceneOptions& options) {
  const ElementSpace& space = curved.mesh.space;
  const ElementSpace linear = space.with_orders(EntityOrders::uniform(space.topology(), 1));
  const std::vector<Vec3> thickness = thickness_at_vertices(shell);
  const int intervals = std::max(4, 2 * space.max_order());
  const auto make = [&](int sheet, SceneSheet& made) {
    const BoundarySamples samples = sheet_samples(shell.layers, space, sheet, intervals);
    made.mesh = as_polygons({samples.positions.apply(curved.mesh.coefficients), samples.triangles});
    made.wires = samples.crease_edges;
    return point_map(linear, samples.points).apply(thickness);
  };
  return scene_of(shell.layers, make, options);
}

std::vector<VertexField> thickness_fields(const ShellResult& shell) {
  return {{"thickness", by_vertex(shell.layers, shell.achieved)},
          {"thickness_asked", by_vertex(shell.layers, shell.asked)},
          {"thickness_limited", by_vertex(shell.layers, shell.limited)},
          {"clearance", by_vertex(shell.layers, shell.clearance)}};
}

/// Returns the distance of the first sheet from the surface along each column of a side. first: strand of the side.
std::vector<double> first_heights(const ShellResult& shell, std::size_t first) {
  const ShellLayers& layers = shell.layers;
  const int sheet = layers.inside + (first == 0 ? -1 : 1);
  std::vector<double> heights;
  for (std::size_t v = 0; v < layers.num_columns(); ++v) {
    const auto column = static_cast<Index>(v);
    heights.push_back((shell.mesh.positions[layers.vertex(sheet, column)] -
                       shell.mesh.positions[layers.vertex(layers.inside, column)])
                          .norm());
  }
  return heights;
}

}  // namespace

std::optional<std::string> inward_warning(const TriangleMesh& surface) {
  // In front of a face the winding number is 0 if the surface faces outward, and -1 if it faces inward; for a surface
  // that encloses nothing it lies in between. Small holes hardly change it.
  constexpr double kMostInwardWindingNumber = -0.9;
  constexpr std::size_t kMostProbedFaces = 2000;
  constexpr double kFaceProbeOffset = 1e-3;  // relative to a face's size
  const std::size_t n = surface.triangles.size(), step = (n + kMostProbedFaces - 1) / kMostProbedFaces;
  std::vector<Vec3> points;
  std::vector<double> areas;
  for (std::size_t t = 0; t < n; t += step) {
    const auto& [a, b, c] = surface.triangles[t];
    const Vec3 &x = surface.positions[a], &y = surface.positions[b], &z = surface.positions[c];
    const Vec3 normal = doubled_area_vector(surface, surface.triangles[t]);
    if (!(normal.norm() > 0)) continue;
    points.push_back((x + y + z) / 3 + kFaceProbeOffset * normal / std::sqrt(normal.norm()));
    areas.push_back(normal.norm());
  }
  if (points.empty()) return std::nullopt;
  const std::vector<double> numbers = WindingNumber(surface).at(points);
  const double area = std::accumulate(areas.begin(), areas.end(), 0.0);
  if (std::inner_product(areas.begin(), areas.end(), numbers.begin(), 0.0) > kMostInwardWindingNumber * area)
    return std::nullopt;
  const SoupTopology edges = soup_topology(surface.positions, surface.triangles);
  const bool is_closed = edges.open_edges == 0 && edges.crowded_edges == 0;
  return "the faces of this " +
         (is_closed ? std::string("closed surface")
                    : "surface, which has " + std::to_string(edges.open_edges) + " open edges" +
                          (edges.crowded_edges > 0
                               ? " and " + std::to_string(edges.crowded_edges) + " of three faces or more,"
                               : ",")) +
         " point inward, so outward is its inside";
}

void write_shell(const Output& output, const ShellResult& shell, const WritingOptions& options) {
  if (shows_surface(output)) {
    write_scene(output.path, scene_of(shell, scene_options(output, options)));
  } else if (holds_polynomial_cells(output)) {
    write_volume(output.path, shell.mesh, shell.quality.cell_minima, thickness_fields(shell), options.msh_version);
    require_written(output.path, shell.mesh, options.msh_version);
  } else {
    write_output(output, shell.mesh, options);
  }
}

void write_shell(const Output& output, const ShellResult& shell, const CurvedShell& curved,
                 const WritingOptions& options) {
  if (output.part == Part::cage) return write_output(output, shell.mesh, options);
  if (shows_surface(output)) return write_scene(output.path, scene_of(shell, curved, scene_options(output, options)));
  if (holds_polynomial_cells(output)) {
    const std::vector<VertexField> fields = thickness_fields(shell);
    return write_curved_cells(output, curved.mesh,
                              {.cell_minima = curved.quality.cell_minima,
                               .reference = shell_reference(shell.layers, shell.limited),
                               .references = shell.mesh.references,
                               .face_groups = &shell.mesh.face_groups,
                               .msh_version = options.msh_version,
                               .vtu_cells = options.vtu_cells,
                               .fields = fields,
                               .map_tolerance_percent = options.map_tolerance_percent});
  }
  write_output(output, HighOrderFile{curved.mesh, shell.mesh.references, shell.mesh.face_groups}, options);
}

void take_figures(const CurvedShell& curved, ShellResult& shell) {
  shell.achieved = curved.thickness.achieved;
  shell.clearance = curved.thickness.clearance;
  shell.quality = curved.quality;
  shell.failures = {curved.quality.certificate, curved.intersecting_faces};
  FitReport& report = shell.report;
  const FitReport& added = curved.report;
  report.stages.insert(report.stages.end(), added.stages.begin(), added.stages.end());
  report.warnings.insert(report.warnings.end(), added.warnings.begin(), added.warnings.end());
  if (report.stop_reason != StopReason::converged) return;
  report.stop_reason = added.stop_reason;
  report.explanation = added.explanation;
}

void refuse_curved(const std::vector<Output>& outputs, const PolygonMesh& surface, int order) {
  std::vector<CellKind> kinds;
  for (std::size_t f = 0; f < surface.num_faces(); ++f)
    kinds.push_back(surface.face_offsets[f + 1] - surface.face_offsets[f] == 3 ? CellKind::prism : CellKind::hex);
  for (const Output& output : outputs) {
    if (output.part == Part::cage) continue;
    if (output.extension == ".usda")
      throw UsageError(output.path.string() +
                       ": .usda holds subdivision cages, not curved cells; take .glb or cage:" + output.path.string());
    require_for_curved_cells(output, kind_orders(kinds, order));
  }
}

Json thickness_json(const ShellResult& shell, double diagonal) {
  Json json = Json::object();
  const std::size_t n = shell.layers.num_columns();
  for_each_side(shell.layers, [&](const char* side, std::size_t first) {
    const auto figures = [&](const std::vector<double>& thickness) {
      const ThicknessFigures f({thickness.data() + first, n});
      return Json{{"mean", f.mean},
                  {"min", f.least},
                  {"max", f.most},
                  {"mean_percent", 100 * f.mean / diagonal},
                  {"min_percent", 100 * f.least / diagonal},
                  {"max_percent", 100 * f.most / diagonal}};
    };
    std::size_t num_limited = 0;
    for (std::size_t v = first; v < first + n; ++v) num_limited += shell.limited[v] < shell.asked[v];
    json[side] = {{"asked", figures(shell.asked)},
                  {"limited", figures(shell.limited)},
                  {"achieved", figures(shell.achieved)},
                  {"clearance", figures(shell.clearance)},
                  {"limited_vertices", num_limited}};
  });
  return json;
}

Json layers_json(const ShellResult& shell) {
  const ShellLayers& layers = shell.layers;
  Json json{{"inside", layers.inside}, {"outside", layers.outside}, {"growth", shell.growth}};
  for_each_side(layers, [&](const char* side, std::size_t first) {
    const ThicknessFigures asked({shell.asked.data() + first, layers.num_columns()});
    const double share = first == 0 ? layers.inside_shares[1] : layers.outside_shares[1];
    json[std::string("first_height_") + side] = share * asked.mean;
    const std::vector<double> heights = first_heights(shell, first);
    const ThicknessFigures achieved(heights);
    json[std::string("first_height_achieved_") + side] = {
        {"mean", achieved.mean}, {"min", achieved.least}, {"max", achieved.most}};
  });
  return json;
}

Json border_json(const ShellResult& shell, double diagonal) {
  const ShellLayers& layers = shell.layers;
  const auto& twins = layers.topology.twins;
  return {{"edges", std::count(twins.begin(), twins.end(), kNoIndex)},
          {"planes", layers.planes.num_planes()},
          {"columns_in_planes", layers.planes.num_columns()},
          {"distance_max_percent", diagonal > 0 ? 100 * shell.border_distance_max / diagonal : 0}};
}

namespace {

/// Returns the area of each group of a surface's faces.
std::vector<double> areas_of_groups(const PolygonMesh& surface) {
  std::vector<double> areas(surface.face_groups.groups.size(), 0);
  std::vector<Index> face_of_triangle;
  const TriangleMesh triangles = triangulate(surface, &face_of_triangle);
  for (std::size_t t = 0; t < triangles.triangles.size(); ++t)
    if (const Index group = surface.face_groups.of_face[face_of_triangle[t]]; group != kNoIndex)
      areas[group] += triangle_area(triangles, triangles.triangles[t]);
  return areas;
}

}  // namespace

Json shell_groups_json(const ShellResult& shell, const PolygonMesh& given) {
  const VolumeFaceGroups& groups = shell.mesh.face_groups;
  std::vector<std::size_t> faces(groups.groups.size(), 0);
  std::vector<double> areas(groups.groups.size(), 0);
  const MeshTopology topology(shell.mesh);
  for (std::size_t f = 0; f < topology.num_faces(); ++f) {
    const auto corners = topology.face(static_cast<Index>(f));
    const Index group = group_of(groups, corners);
    if (group == kNoIndex) continue;
    ++faces[group];
    const auto x = [&](std::size_t k) -> const Vec3& { return shell.mesh.positions[corners[k]]; };
    for (std::size_t k = 1; k + 1 < corners.size(); ++k)
      areas[group] += (x(k) - x(0)).cross(x(k + 1) - x(0)).norm() / 2;
  }
  const std::vector<Group>& given_groups = given.face_groups.groups;
  const std::vector<double> given_areas = given_groups.empty() ? std::vector<double>() : areas_of_groups(given);
  Json json = Json::array();
  for (std::size_t g = 0; g < faces.size(); ++g) {
    json.push_back({{"name", as_utf8(groups.groups[g].name)},
                    {"number", groups.groups[g].number},
                    {"area", areas[g]},
                    {"faces", faces[g]}});
    const auto same = std::ranges::find(given_groups, groups.groups[g]);
    if (same != given_groups.end()) json.back()["target_area"] = given_areas[same - given_groups.begin()];
  }
  return json;
}

Json corner_quality_json(const ShellResult& shell) {
  return {{"min_scaled_jacobian", shell.corner_quality.min_scaled_jacobian},
          {"mean_scaled_jacobian", shell.corner_quality.mean_scaled_jacobian}};
}

std::vector<std::string> thickness_warnings(const ShellResult& shell, std::optional<double> first_height) {
  constexpr double kLeastAchievedThicknessShare = 0.5, kMostFirstHeightError = 0.1;
  std::vector<std::string> warnings;
  const std::size_t n = shell.layers.num_columns();
  for_each_side(shell.layers, [&](const char* side, std::size_t first) {
    const ThicknessFigures asked({shell.asked.data() + first, n}), found({shell.achieved.data() + first, n});
    if (found.mean < kLeastAchievedThicknessShare * asked.mean)
      warnings.push_back(
          formatted("the layers %s are %.6g thick on average, %.3g %% of what was asked: they could not grow "
                    "further",
                    side, found.mean, 100 * found.mean / asked.mean));
    if (!first_height) return;
    const std::vector<double> heights = first_heights(shell, first);
    const ThicknessFigures height(heights);
    if (std::abs(height.mean - *first_height) > kMostFirstHeightError * *first_height)
      warnings.push_back(formatted("the first layer %s is %.6g to %.6g high, %.6g on average, where %.6g was asked",
                                   side, height.least, height.most, height.mean, *first_height));
  });
  return warnings;
}

std::string thickness_text(const ShellResult& shell) {
  std::string text;
  const std::size_t n = shell.layers.num_columns();
  for_each_side(shell.layers, [&](const char* side, std::size_t first) {
    const ThicknessFigures asked({shell.asked.data() + first, n}), found({shell.achieved.data() + first, n});
    char line[200];
    std::snprintf(line, sizeof line, "thickness %-9s asked %.6g, achieved mean %.6g (%.1f %%), min %.6g, max %.6g\n",
                  side, asked.mean, found.mean, 100 * found.mean / asked.mean, found.least, found.most);
    text += line;
  });
  return text;
}

}  // namespace subvol::cli
