// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/runs/check_report.h"

#include "cli/runs/run_options.h"
#include "subvol/base/format.h"
#include "subvol/export/high_order_file.h"
#include "subvol/fit/automatic_fit.h"
#include "subvol/fit/elements/polynomial_map.h"
#include "subvol/fit/quality/high_order_quality.h"
#include "subvol/mesh/validate.h"

#include <algorithm>
#include <cmath>
#include <sstream>

namespace subvol::cli {

using namespace internal;
std::vector<Index> not_certified_cells(const MeshCheck& check) {
  return check.quality ? check.quality->certificate.not_certified : std::vector<Index>{};
}

Json quality_json(const QualityReport& quality) {
  Json worst = Json::array();
  for (const auto& cell : quality.worst_cells) {
    worst.push_back({{"cell", cell.cell}, {"center", point_json(cell.center)}, {"scaled_jacobian", cell.value}});
  }
  return {{"cells", quality.num_cells},
          {"min_scaled_jacobian", quality.min_scaled_jacobian},
          {"mean_scaled_jacobian", quality.mean_scaled_jacobian},
          {"inverted_cells", quality.inverted_cells},
          {"certified_cells", quality.certificate.certified},
          {"invalid_cells", quality.certificate.invalid},
          {"undecided_cells", quality.certificate.undecided},
          {"worst_cells", std::move(worst)},
          {"histogram", quality.histogram}};
}

LagrangeCheck check_lagrange_cells(const std::filesystem::path& path, const HighOrderMesh& mesh) {
  // Covers the rounding of points and of the interpolation through them (`polynomials_of`), far below any distance that
  // matters.
  constexpr double kRoundingPercent = 1e-7;
  const HighOrderMesh cells = read_polynomial_cells(path);
  LagrangeCheck check;
  const int samples = 2 * std::max(mesh.space.max_order(), cells.space.max_order()) + 1;
  check.difference_percent = 100 * sampled_distance(mesh, cells, samples) / vertex_diagonal(mesh);
  check.differs = !(check.difference_percent <= kRoundingPercent);
  check.quality = measure_quality(cells);
  return check;
}

Json lagrange_json(const LagrangeCheck& check) {
  return {{"valid", check.valid()},
          {"differs_from_map", check.differs},
          {"difference_from_map_percent", check.difference_percent},
          {"quality", quality_json(check.quality)}};
}

std::string to_text(const LagrangeCheck& check) {
  if (!check.differs && check.valid()) return "Lagrange cells      as other programs read them: the same map\n";
  return formatted(
      "Lagrange cells      as other programs read them: up to %.3g %% of the diagonal from the map, %zu of %zu "
      "certified, scaled Jacobian min %.4f%s\n",
      check.difference_percent, check.quality.certificate.certified, check.quality.num_cells,
      check.quality.min_scaled_jacobian, check.valid() ? "" : ": NOT VALID");
}

namespace {

Json witnesses_json(std::span<const InversionWitness> witnesses) {
  Json json = Json::array();
  for (const auto& [cell, canonical, position, determinant] : witnesses)
    json.push_back({{"cell", cell},
                    {"canonical", point_json(canonical)},
                    {"position", point_json(position)},
                    {"determinant", determinant}});
  return json;
}

Json topology_json(const MeshCheck& check) {
  return {{"components", check.num_components},
          {"boundary_components", check.num_boundary_components},
          {"boundary_vertices", check.num_boundary_vertices},
          {"boundary_edges", check.num_boundary_edges},
          {"boundary_faces", check.num_boundary_faces},
          {"boundary_euler_number", check.boundary_euler_number},
          {"euler_number", check.euler_number}};
}

Json orders_json(const OrderSummary& orders) {
  return {{"basis", to_string(orders.basis)},
          {"min", orders.min_order},
          {"max", orders.max_order},
          {"nodes", orders.num_nodes},
          {"full_order_nodes", orders.num_full_order_nodes}};
}

Json unused_vertices_json(const MeshCheck& check) {
  Json vertices = Json::array();
  for (const MeshDefect& defect : check.defects)
    if (defect.kind == MeshDefect::Kind::unused_vertex) vertices.push_back(defect.entity);
  return vertices;
}

Json defects_json(const MeshCheck& check) {
  Json defects = Json::array();
  for (const MeshDefect& defect : check.defects) {
    if (defect.kind == MeshDefect::Kind::unused_vertex) continue;  // it does not make a mesh invalid
    defects.push_back({{"kind", to_string(defect.kind)}, {"entity", defect.entity}, {"message", defect.message}});
  }
  return defects;
}

}  // namespace

Json check_json(const MeshCheck& check) {
  Json json{{"valid", check.valid()}};
  if (check.ended_early) json["ended_early"] = true;
  if (check.distance) json["distance"] = distance_json(*check.distance, check.target_diagonal);
  if (check.normals)
    json["normal_deviation"] = {{"mean_degrees", check.normals->mean_degrees},
                                {"percentile_95_degrees", check.normals->percentile_95_degrees}};
  if (check.orders) json["orders"] = orders_json(*check.orders);
  if (check.quality) json["quality"] = quality_json(*check.quality);
  if (check.regions) json["regions"] = regions_json(*check.regions);
  if (!check.witnesses.empty()) json["inverted_at"] = witnesses_json(check.witnesses);
  if (check.has_boundary_geometry) {
    json["boundary_self_intersections"] = check.num_intersecting_triangle_pairs;
    json["intersecting_boundary_faces"] = check.intersecting_faces;
    json["degenerate_boundary_triangles"] = check.num_degenerate_boundary_triangles;
    if (!check.parts_inside_solids.empty()) {
      Json& parts = json["parts_inside_solids"] = Json::array();
      for (const Vec3& place : check.parts_inside_solids) parts.push_back(point_json(place));
    }
    json["volume"] = check.volume;
    if (check.orders) json["boundary_chord_error"] = check.chord_error;
  }
  if (check.has_topology) json["topology"] = topology_json(check);
  json["defects"] = defects_json(check);
  if (const Json unused = unused_vertices_json(check); !unused.empty()) json["unused_vertices"] = unused;
  return json;
}

Json regions_json(const RegionReport& report, const RegionReport* start, const char* prefix) {
  const std::string volume = std::string(prefix) + "_volume", area = std::string(prefix) + "_area";
  Json regions = Json::array(), interfaces = Json::array();
  for (const RegionQuality& region : report.regions) {
    Json one{{"reference", region.reference},
             {"cells", region.num_cells},
             {"not_certified", region.num_uncertified},
             {"volume", region.volume},
             {"boundary_area", region.area},
             {"min_scaled_jacobian", region.min_scaled_jacobian}};
    if (!region.name.empty()) one["name"] = as_utf8(region.name);
    if (start)
      for (const RegionQuality& before : start->regions)
        if (before.reference == region.reference) one[volume] = before.volume;
    regions.push_back(std::move(one));
  }
  for (const InterfaceArea& interface : report.interfaces) {
    Json one{{"references", interface.references}, {"faces", interface.num_faces}, {"area", interface.area}};
    if (start)
      for (const InterfaceArea& before : start->interfaces)
        if (before.references == interface.references) one[area] = before.area;
    interfaces.push_back(std::move(one));
  }
  return {{"cells", std::move(regions)}, {"interfaces", std::move(interfaces)}};
}

Json regions_json(const RegionReport& report, const std::optional<RegionSurface>& target, const VolumeMesh& start) {
  const RegionReport before = target ? measure_regions(*target) : measure_regions(start, nullptr);
  return regions_json(report, &before, target ? "target" : "start");
}

std::vector<std::string> warnings_of_volumes(const RegionReport& result, const RegionReport& wanted,
                                             const std::string& whose) {
  std::vector<std::string> warnings;
  for (const RegionQuality& region : result.regions) {
    const auto other = std::ranges::find(wanted.regions, region.reference, &RegionQuality::reference);
    if (other == wanted.regions.end()) continue;
    const double percent = 100 * (region.volume / other->volume - 1);
    if (std::abs(percent) <= kAutomaticVolumePercent) continue;
    const std::string name = region.name.empty() ? "region " + std::to_string(region.reference) : region.name;
    warnings.push_back(formatted("the volume of %s is %.6g, in the %s it is %.6g (%+.2g %%)", name.c_str(),
                                 region.volume, whose.c_str(), other->volume, percent));
  }
  return warnings;
}

std::vector<std::string> warnings_of_volumes(const MeshCheck& check, const std::optional<RegionSurface>& target) {
  if (!check.regions || !target) return {};
  return warnings_of_volumes(*check.regions, measure_regions(*target), "target");
}

Json audit_json(const SubdivisionAudit& found) {
  return {{"boundary_edges", found.num_boundary_edges},
          {"flattened_edges", found.flattened_edges.size()},
          {"reflex_creases", found.reflex_creases.size()},
          {"folding_corners", found.folding_corners},
          {"warnings", found.warnings}};
}

Json creases_json(const CreaseDistance& creases) {
  return {{"target_curves", creases.num_curves},
          {"followed_curves", creases.num_followed},
          {"target_length_percent", creases.target_length_percent},
          {"followed_share", creases.followed_share()},
          {"share_within_tenth_percent", creases.within_share()},
          {"mean_percent", creases.mean_percent()},
          {"max_percent", creases.max_percent()},
          {"mean_from_target_percent", creases.mean_from_target_percent},
          {"mean_to_target_percent", creases.mean_to_target_percent},
          {"max_from_target_percent", creases.max_from_target_percent},
          {"max_to_target_percent", creases.max_to_target_percent},
          {"farthest", point_json(creases.farthest)},
          {"crease_length_percent", creases.crease_length_percent}};
}

std::string to_text(const CreaseDistance& creases) {
  std::ostringstream text;
  text << "sharp edges         creases follow " << creases.num_followed << " of " << creases.num_curves << " curves ("
       << 100 * creases.followed_share() << " % of their length): mean " << creases.mean_percent() << " %, max "
       << creases.max_percent() << " % of the diagonal; " << 100 * creases.within_share() << " % of all within "
       << kSharpPercent << " %\n";
  return text.str();
}

Json distance_json(const SurfaceDistance& distance, double diagonal) {
  const double percent = 100 / diagonal;
  const auto& farthest = distance.extreme();
  if (distance.one_sided)
    return {{"one_sided", true},
            {"mean_percent", distance.mean() * percent},
            {"max_percent", distance.max() * percent},
            {"mean", distance.mean()},
            {"max", distance.max()},
            {"mean_from_target_percent", distance.mean_b_to_a * percent},
            {"max_from_target_percent", distance.max_b_to_a.distance * percent},
            {"farthest", {{"from", point_json(farthest.from)}, {"to", point_json(farthest.to)}}}};
  return {{"mean_percent", distance.mean() * percent},
          {"max_percent", distance.max() * percent},
          {"mean", distance.mean()},
          {"max", distance.max()},
          {"mean_to_target_percent", distance.mean_a_to_b * percent},
          {"mean_from_target_percent", distance.mean_b_to_a * percent},
          {"max_to_target_percent", distance.max_a_to_b.distance * percent},
          {"max_from_target_percent", distance.max_b_to_a.distance * percent},
          {"farthest", {{"from", point_json(farthest.from)}, {"to", point_json(farthest.to)}}}};
}

}  // namespace subvol::cli
