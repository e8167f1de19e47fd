// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/runs/automatic_fit_report.h"

#include "cli/runs/check_report.h"

#include <algorithm>
#include <optional>
#include <utility>

namespace subvol::cli {
namespace {

Json feature_miss_json(const std::optional<FeatureMiss>& miss) {
  if (!miss) return {};
  return {{"share", miss->share},
          {"distance", miss->distance},
          {"radius", miss->size},
          {"at", {miss->place.x(), miss->place.y(), miss->place.z()}}};
}

Json trials_json(const AutomaticFitResult& result) {
  Json trials = Json::array();
  for (const AutomaticFitTrial& trial : result.trials)
    trials.push_back({{"template_cells", trial.template_cells},
                      {"level", trial.level},
                      {"cells", trial.cells},
                      {"through_planes", trial.through_planes},
                      {"grids", trial.grids},
                      {"refined_cells", trial.refined_cells},
                      {"pads", trial.pads},
                      {"sharp_edges", trial.curves},
                      {"followed_edges", trial.followed_curves},
                      {"edges_within_share", trial.within_share},
                      {"mean_percent", trial.mean_percent},
                      {"max_percent", trial.max_percent},
                      {"volume_percent", std::max(trial.volume_percent, trial.solid_volume_percent)},
                      {"feature_miss", feature_miss_json(trial.feature_miss)},
                      {"lost_feature", feature_miss_json(trial.lost_feature)},
                      {"min_scaled_jacobian", trial.least_scaled_jacobian},
                      {"mean_scaled_jacobian", trial.mean_scaled_jacobian},
                      {"self_intersections", trial.self_intersections ? Json(*trial.self_intersections) : Json()},
                      {"polished", trial.is_polished},
                      {"relaxed_at", trial.relaxed_at ? point_json(*trial.relaxed_at) : Json()},
                      {"uncertified_cells", trial.uncertified},
                      {"merit", trial.merit}});
  return {{"components", result.topology.components},
          {"handles", result.topology.handles},
          {"cavities", result.topology.cavities},
          {"trials", std::move(trials)},
          {"chosen", result.chosen}};
}

Json missed_edges_json(const AutomaticFitResult& result) {
  Json edges = Json::array();
  for (const MissedEdge& edge : result.missed_edges)
    edges.push_back({{"why", to_string(edge.reason)},
                     {"at", {edge.place.x(), edge.place.y(), edge.place.z()}},
                     {"length_percent", edge.length_percent}});
  return edges;
}

}  // namespace

Json automatic_fit_json(const AutomaticFitResult& result) {
  Json json{{"template", trials_json(result)}};
  if (!result.report.creases) return json;
  json["creases"] = creases_json(*result.report.creases);
  json["edges_not_followed"] = missed_edges_json(result);
  return json;
}

}  // namespace subvol::cli
