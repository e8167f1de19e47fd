// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/verbs/high_order_fit_run.h"

#include "cli/runs/automatic_fit_report.h"
#include "cli/runs/check_report.h"
#include "cli/runs/checkpointing.h"
#include "cli/runs/diagnosis_report.h"
#include "cli/runs/exit_status.h"
#include "cli/runs/face_groups.h"
#include "cli/runs/interrupt.h"
#include "cli/runs/loading.h"
#include "cli/runs/losses.h"
#include "cli/runs/outputs.h"
#include "cli/runs/progress.h"
#include "cli/runs/report.h"
#include "cli/runs/untangling.h"
#include "cli/runs/written_result.h"
#include "cli/verbs/verb_options.h"
#include "subvol/base/error.h"
#include "subvol/base/process_memory.h"
#include "subvol/base/version.h"
#include "subvol/fit/mesh_check.h"
#include "subvol/fit/quality/high_order_quality.h"
#include "subvol/fit/quality/quality.h"
#include "subvol/fit/stages/fit_report.h"
#include "subvol/mesh/pyramids.h"
#include "subvol/templates/voxel_grid.h"

#include <algorithm>
#include <chrono>
#include <iostream>
#include <optional>

namespace subvol::cli {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

/// Refuses, before the work, outputs to which no curved mesh can be written; the template's cells represent the result.
void refuse_impossible(const std::vector<Output>& outputs, const VolumeMesh& cells, int order) {
  internal::require_no_pyramids(cells.kinds, "template mesh: pyramids cannot be curved");
  for (const Output& output : outputs) require_for_curved_cells(output, kind_orders(cells.kinds, order));
}

/// seconds: the part of the time limit that has been used.
HighOrderFitResult fit(const HighOrderFitArguments& arguments, StageLog* log, bool keep_states, double seconds,
                       const Target& target, const LoadedTemplate& start) {
  ProgressTeller teller(arguments.run.progress, arguments.run.quiet);
  HighOrderFitOptions options = arguments.fit;
  options.log = log;
  options.keep_states = keep_states;
  if (options.time_limit_seconds > 0) options.time_limit_seconds = std::max(1e-3, options.time_limit_seconds - seconds);
  options.progress = [&](const FitProgress& progress) {
    catch_interrupt();
    teller.tell(progress);
    return !interrupted();
  };
  options.cancelled = interrupted;
  HighOrderFitResult result =
      start.curved
          ? fit_high_order(std::get<TriangleMesh>(target), *start.curved, start.mesh, options)
          : std::visit([&](const auto& geometry) { return fit_high_order(geometry, start.mesh, options); }, target);
  teller.finish();
  if (!interrupted()) end_on_interrupt();
  return result;
}

MeshCheck check(const HighOrderMesh& mesh, const CellLabels& labels, const Target& target,
                const WritingOptions& writing, const RunOptions& run) {
  ProgressTeller teller(run.progress, run.quiet);
  const CurvedBoundary boundary = curved_boundary(mesh, measured_chord_percent(writing));
  const MeshCheckOptions options{.labels = labels, .progress = teller.work()};
  return std::visit([&](const auto& geometry) { return check_mesh(mesh, boundary, &geometry, options); }, target);
}

/// Check of the linear cells that were written in place of the curved ones; none if there is no such file.
std::optional<MeshCheck> check_linear(const std::vector<Output>& outputs, const Target& target, const RunOptions& run) {
  const std::optional<VolumeMesh> written = written_cells(outputs);
  if (!written) return {};
  ProgressTeller teller(run.progress, run.quiet);
  const MeshCheckOptions options{.progress = teller.work()};
  return std::visit([&](const auto& geometry) { return check_mesh(*written, &geometry, options); }, target);
}

/// Adds lambda, whose default depends on the template.
Json options_used(const HighOrderFitArguments& arguments, double lambda_close, Json options) {
  options[arguments.untangles ? "lambda" : "lambda-close"] = lambda_close;
  return options;
}

Json report_json(const char* command, Json options, Json input, const FitReport& report, const HighOrderMesh& mesh,
                 const MeshCheck& mesh_check) {
  Json json{{"subvol", version()},
            {"command", command},
            {"options", std::move(options)},
            {"input", std::move(input)},
            {"mesh", describe("", mesh)}};
  json.update(fit_json(report));
  json.update(check_json(mesh_check));
  return json;
}

int status(const FitReport& report, bool valid) {
  if (report.stop_reason == StopReason::cancelled) return kInterrupted;
  if (!valid) return kFailed;
  return report.stop_reason == StopReason::converged ? kDone : kNotConverged;
}

}  // namespace

int run_high_order_fit(const HighOrderFitArguments& arguments, const CLI::App& verb) {
  if (arguments.run.outputs.empty() && arguments.run.report.empty())
    throw UsageError(std::string(arguments.command) + ": nothing to write; give -o FILE or --report FILE");
  const Clock::time_point start = Clock::now();
  std::vector<Output> outputs =
      checked_outputs(arguments.run, {Part::cutaway, Part::animation, Part::boundary, Part::region});
  apply_resources(arguments.run);
  std::vector<std::string> warnings = unused_output_options(verb, outputs);
  std::size_t told = 0;
  const auto tell_warnings = [&] {
    for (; !arguments.run.quiet && told < warnings.size(); ++told)
      std::cerr << "subvol: warning: " << warnings[told] << '\n';
  };
  Target target = arguments.takes_points ? load_target_with_regions(arguments.target, warnings)
                                         : Target(load_surface(arguments.target, warnings));
  require_fitting_options(verb, is_cloud(target));
  if (const auto* surface = std::get_if<TriangleMesh>(&target)) warn_of_missing_groups(verb, *surface, warnings);
  if (arguments.template_mesh.path.empty()) {  // made templates consist of hexes, and making one takes minutes
    refuse_impossible(outputs, voxel_mesh(box_grid(Vec3::Zero(), Vec3::Ones(), {1, 1, 1})), arguments.fit.order);
    repair_to_fill(target, arguments.template_fit.regions, warnings);
    require_resumable(arguments.run, run_identity(verb, {{"target", fingerprint(target)}}));
  }
  const Clock::time_point template_start = Clock::now();
  AutomaticFitOptions making = arguments.template_fit;
  making.time_limit_seconds = kTemplateShareOfTime * arguments.fit.time_limit_seconds;
  LoadedTemplate loaded =
      load_template(arguments.template_mesh, target, making, arguments.run, warnings, TemplateUse::curved_cells);
  const double template_seconds = seconds_since(template_start);
  VolumeMesh& template_mesh = loaded.mesh;
  if (!loaded.made) warn_of_losses(marks_of(template_mesh), marks_of(template_mesh), outputs, warnings, true);
  tell_warnings();
  if (loaded.made && !arguments.run.quiet) std::cerr << template_text(*loaded.made);
  if (template_mesh.num_cells() == 0) return kInterrupted;  // nothing has been fitted yet
  refuse_impossible(outputs, template_mesh,
                    std::max(arguments.fit.order, loaded.curved ? loaded.curved->space.max_order() : 1));
  require_regions(outputs, regions_of(template_mesh));
  if (loaded.curved && is_cloud(target))
    throw UsageError(arguments.template_mesh.path + ": curved cells are drawn to a surface, not to points");
  if (loaded.curved && verb.count("--order") > 0 && arguments.fit.order < loaded.curved->space.max_order())
    throw UsageError("--order " + std::to_string(arguments.fit.order) + ": " + arguments.template_mesh.path +
                     " has cells of order " + std::to_string(loaded.curved->space.max_order()) +
                     ", and orders are not lowered");
  const double read_seconds = seconds_since(start) - template_seconds;
  Json input{{"target", describe(arguments.target, target)}};
  input[arguments.untangles ? "mesh" : "template"] = describe(arguments.template_mesh.path, template_mesh);
  if (arguments.untangles && !arguments.run.report.empty())
    input["quality"] =
        quality_json(loaded.curved ? internal::measure_quality(*loaded.curved) : measure_quality(template_mesh));
  Checkpointing checkpointing(
      arguments.run, run_identity(verb, {{"target", fingerprint(target)}, {"template", fingerprint(template_mesh)}}));
  const Clock::time_point untangle_start = Clock::now();
  if (loaded.curved || arguments.untangles || has_few_inverted_cells(template_mesh)) {
    const OptimizeOptions untangling{.time_limit_seconds = arguments.fit.time_limit_seconds,
                                     .log = checkpointing.log()};
    const std::string& path = arguments.template_mesh.path;
    try {
      if (loaded.curved)
        untangle_template(path, arguments.run, untangling, template_mesh, *loaded.curved, warnings);
      else
        untangle_template(path, arguments.run, untangling, template_mesh, warnings);
    } catch (const EndedEarly&) {
      checkpointing.finish(warnings);
      tell_warnings();
      throw;
    }
  }
  const double untangle_seconds = seconds_since(untangle_start);
  const Clock::time_point fit_start = Clock::now();
  HighOrderFitResult result =
      fit(arguments, checkpointing.log(), has_animation(outputs), seconds_since(start), target, loaded);
  const double fit_seconds = seconds_since(fit_start);
  FitReport& report = result.report;
  checkpointing.finish(warnings);
  warnings.insert(warnings.end(), report.warnings.begin(), report.warnings.end());
  tell_warnings();

  const Clock::time_point write_start = Clock::now();
  WritingOptions writing = arguments.writing;
  writing.source = arguments.target;
  writing.options = options_used(arguments, result.lambda_close, options_of_result(verb));
  HighOrderFile file{std::move(result.mesh), template_mesh.references, template_mesh.face_groups,
                     template_mesh.regions};
  const auto [regions, outer] = fitted_target(target, template_mesh);
  const GroupsFound groups = carry_groups(outer, file);
  warnings.insert(warnings.end(), groups.warnings.begin(), groups.warnings.end());
  warn_of_names(marks_of(file), outputs, warnings);
  tell_warnings();
  const std::vector<std::string> failures = write_each(outputs, [&](const Output& output) {
    if (output.part == Part::animation)
      write_animation(output, file.mesh, result.states, writing);
    else
      write_output(output, file, writing);
  });
  const double write_seconds = seconds_since(write_start);

  const Clock::time_point check_start = Clock::now();
  const auto check_curved = [&](const HighOrderMesh& mesh) {
    return check(mesh, {file.references, file.regions}, outer, writing, arguments.run);
  };
  const std::optional<HighOrderMesh> written = written_curved_cells(outputs);
  const MeshCheck mesh_check = check_curved(written ? *written : file.mesh);
  hold_to({.mean_percent = arguments.fit.tolerance_percent}, mesh_check, report);
  hold_to_quality(arguments.quality_floor, mesh_check, report);
  for (std::string& warning : warnings_of_quality(arguments.fit.quality, mesh_check))
    warnings.push_back(std::move(warning));
  for (std::string& warning : warnings_of_volumes(mesh_check, regions)) warnings.push_back(std::move(warning));
  const std::vector<PolynomialCells> polynomials =
      check_polynomial_cells(outputs, file.mesh, writing.map_tolerance_percent, check_curved);
  for (const PolynomialCells& cells : polynomials) {
    hold_to({.mean_percent = arguments.fit.tolerance_percent}, cells.check, report);
    const std::vector<std::string> found = polynomial_cells_warnings(cells);
    warnings.insert(warnings.end(), found.begin(), found.end());
  }
  tell_warnings();
  const std::optional<MeshCheck> linear = check_linear(outputs, outer, arguments.run);
  if (linear) {
    const std::vector<std::string> found = linear_cells_warnings(*linear);
    warnings.insert(warnings.end(), found.begin(), found.end());
    tell_warnings();
    const bool stands_alone = std::none_of(outputs.begin(), outputs.end(), holds_polynomial_cells);
    if (stands_alone) hold_to({.mean_percent = arguments.fit.tolerance_percent}, *linear, report);
  }
  if (!arguments.run.report.empty()) {
    Json json = report_json(arguments.command, options_used(arguments, result.lambda_close, options_in_force(verb)),
                            std::move(input), report, file.mesh, mesh_check);
    if (report.creases) json["creases"] = creases_json(*report.creases);
    if (mesh_check.regions) json["regions"] = regions_json(*mesh_check.regions, regions, template_mesh);
    if (!groups.groups.empty()) json["groups"] = groups_json(groups.groups);
    if (linear) json["linear_cells"] = check_json(*linear);
    if (!polynomials.empty()) json["polynomial_cells"] = polynomial_cells_json(polynomials);
    if (arguments.untangles) json["not_certified_cells"] = not_certified_cells(mesh_check);
    if (loaded.made) json["template"] = automatic_fit_json(*loaded.made).at("template");
    checkpointing.describe(json);
    json["warnings"] = warnings_json(warnings, failures);
    Json seconds{{"read", read_seconds},
                 {arguments.untangles ? "untangle" : "template", template_seconds + untangle_seconds},
                 {"fit", fit_seconds},
                 {"write", write_seconds},
                 {"check", seconds_since(check_start)}};
    seconds.update(seconds_json(report));
    seconds["total"] = seconds_since(start);
    json["seconds"] = std::move(seconds);
    json["peak_memory_bytes"] = internal::peak_memory_bytes();
    json["outputs"] = output_names(outputs);
    write_report(arguments.run.report, json);
  }
  if (!arguments.run.quiet) {
    std::cerr << to_string(report.stop_reason) << ": " << report.explanation << '\n' << to_text(mesh_check);
    if (report.creases) std::cerr << to_text(*report.creases);
    for (const Output& output : outputs) std::cerr << "wrote " << output.path.string() << '\n';
  }
  require_all_written(failures);
  const int of_fit = status(report, mesh_check.valid() && (!linear || linear->valid()));
  return of_fit == kDone ? polynomial_cells_status(polynomials) : of_fit;
}

}  // namespace subvol::cli
