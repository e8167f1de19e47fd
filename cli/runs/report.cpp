// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/runs/report.h"

#include "subvol/base/atomic_file.h"

#include <cmath>
#include <stdexcept>
#include <vector>

namespace subvol::cli {
namespace {

void require_finite(const Json& value, const std::string& where) {
  if (value.is_number_float() && !std::isfinite(value.get<double>())) {
    throw std::runtime_error("report entry " + where + " is not a finite number");
  }
  if (!value.is_structured()) return;
  for (const auto& [key, item] : value.items()) require_finite(item, where + '/' + key);
}

Json& command_line() {
  static Json words = Json::array();
  return words;
}

Json energy_json(const StageRecord& stage, const IterationRecord& iteration) {
  return {{"total", iteration.surface_energy + stage.lambda * iteration.volume_energy},
          {"surface", iteration.surface_energy},
          {"volume", iteration.volume_energy}};
}

Json iteration_json(const StageRecord& stage, const IterationRecord& iteration) {
  return {{"energy", energy_json(stage, iteration)},
          {"step_length", iteration.step_length},
          {"linear_iterations", iteration.linear_iterations},
          {"evaluations", iteration.evaluations}};
}

Json stage_json(const StageRecord& stage) {
  Json history = Json::array();
  int evaluations = 0;
  for (const IterationRecord& iteration : stage.iterations) {
    history.push_back(iteration_json(stage, iteration));
    evaluations += iteration.evaluations;
  }
  Json json{{"name", stage.name},
            {stage.order > 0 ? "order" : "level", stage.order > 0 ? stage.order : stage.level},
            {"lambda", stage.lambda},
            {"tangential_weight", stage.tangential_weight},
            {"unknowns", stage.unknowns},
            {"cells", stage.cells},
            {"iterations", stage.iterations.size()},
            {"evaluations", evaluations}};
  if (!stage.iterations.empty()) json["energy"] = energy_json(stage, stage.iterations.back());
  if (stage.mean_distance_percent >= 0) json["mean_distance_percent"] = stage.mean_distance_percent;
  json["stop"] = stage.stop;
  json["kept"] = stage.kept;
  json["seconds"] = stage.seconds;
  json["history"] = std::move(history);
  return json;
}

Json target_json(const TargetReport& target) {
  Json json{{"area", target.area}, {"volume", target.volume}, {"volume_source", to_string(target.volume_source)}};
  if (target.num_points > 0) {
    json["points"] = target.num_points;
    return json;
  }
  json["open_edges"] = target.edges.open_edges;
  json["turned_edges"] = target.edges.turned_edges;
  json["crowded_edges"] = target.edges.crowded_edges;
  json["closed_manifold"] = target.topology.has_value();
  const auto betti_json = [](const BettiNumbers& numbers) -> Json {
    return {{"components", numbers.components},
            {"handles", numbers.handles},
            {"cavities", numbers.cavities},
            {"boundary_euler_number", 2 * numbers.euler_number()}};
  };
  if (target.topology) json["topology"] = betti_json(*target.topology);
  if (target.template_topology) {
    json["template_topology"] = betti_json(*target.template_topology);
    json["same_topology"] = target.same_topology();
  }
  return json;
}

}  // namespace

Json stages_json(const FitReport& report) {
  Json stages = Json::array();
  for (const StageRecord& stage : report.stages) stages.push_back(stage_json(stage));
  return stages;
}

Json fit_json(const FitReport& report) {
  Json json{
      {"stop_reason", to_string(report.stop_reason)},
      {"explanation", report.explanation},
      {"converged", report.stop_reason == StopReason::converged},
      {"stages", stages_json(report)},
      {"initial_distance",
       {{"mean_percent", report.initial_distance_mean_percent}, {"max_percent", report.initial_distance_max_percent}}}};
  if (report.target.area > 0) json["target"] = target_json(report.target);
  return json;
}

Json seconds_json(const FitReport& report) {
  Json seconds = Json::object();
  for (const auto& [part, value] : report.seconds) seconds[part] = value;
  return seconds;
}

std::string json_text(const Json& report) {
  require_finite(report, "");
  Json whole = report;
  if (!command_line().empty()) whole["command_line"] = command_line();
  // File names need not be UTF-8.
  return whole.dump(2, ' ', false, Json::error_handler_t::replace) + '\n';
}

void remember_command_line(int argc, const char* const* argv) {
  command_line() = std::vector<std::string>(argv, argv + argc);
}

void write_report(const std::filesystem::path& path, const Json& report) {
  write_file_atomically(path, json_text(report));
}

}  // namespace subvol::cli
