// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/verbs/subdivision_fit_run.h"

#include "cli/runs/automatic_fit_report.h"
#include "cli/runs/check_report.h"
#include "cli/runs/checkpointing.h"
#include "cli/runs/diagnosis_report.h"
#include "cli/runs/exit_status.h"
#include "cli/runs/face_groups.h"
#include "cli/runs/loading.h"
#include "cli/runs/losses.h"
#include "cli/runs/report.h"
#include "cli/runs/untangling.h"
#include "cli/runs/written_result.h"
#include "cli/verbs/cage_run.h"
#include "cli/verbs/verb_options.h"
#include "subvol/base/format.h"
#include "subvol/base/version.h"
#include "subvol/fit/stages/fit_report.h"

#include <algorithm>
#include <iostream>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace subvol::cli {
namespace {

/// Returns true if cells are written, and nothing that needs the cage.
bool writes_cells_without_cage(std::span<const Output> outputs) {
  return std::ranges::any_of(outputs, [](const Output& output) { return output.is_volume(); }) &&
         std::ranges::none_of(
             outputs, [](const Output& output) { return output.part == Part::cage || output.part == Part::animation; });
}

/// One run of `fit` that makes a subdivision volume, from its input files to its output files.
class SubdivisionFitRun : public CageRun {
 public:
  SubdivisionFitRun(const SubdivisionFitArguments& arguments, const CLI::App& verb)
      : CageRun(arguments.run, verb), arguments_(arguments) {}
  int run();

 private:
  void load();
  void load_template();
  void fit();
  void write();
  void check();
  Json report() const;
  void summarize() const;
  bool has_cage() const { return result_.cage.num_cells() > 0; }
  /// Returns true if the mesh may be freed from its cage, as far as that is known without the template.
  bool frees_mesh() const {
    const FitOptions& fit = arguments_.fit;
    return fit.frees_mesh && fit.quality > 0 && !fit.keeps_groups && !is_cloud(target_) &&
           writes_cells_without_cage(outputs_);
  }
  /// Returns what a resumed run must have in common with this one, but for its options and its template.
  std::vector<std::pair<std::string, std::string>> identity_of_target() const {
    return {{"target", fingerprint(target_)},
            {"outputs", frees_mesh() ? "cells without a cage" : "a cage, or a scene without cells"}};
  }

  const SubdivisionFitArguments& arguments_;
  Target target_;
  std::optional<RegionSurface> regions_;  ///< of the target, if the template has the same
  Target outer_;                          ///< what the boundary is compared with
  VolumeMesh template_mesh_;
  std::optional<AutomaticFitResult> made_;  ///< if the template was made
  std::optional<Checkpointing> checkpointing_;
  FitResult result_;
  GroupsFound groups_;
  MeshCheck mesh_check_;
};

void SubdivisionFitRun::load() {
  target_ = load_target_with_regions(arguments_.target, warnings_);
  require_fitting_options(verb_, is_cloud(target_));
  if (const auto* surface = std::get_if<TriangleMesh>(&target_)) warn_of_missing_groups(verb_, *surface, warnings_);
  if (verb_.count("--lambda-far") > 0 && arguments_.fit.lambda_far < arguments_.fit.lambda_close)
    warnings_.push_back(
        internal::formatted("--lambda-far %g has no effect: it is below --lambda-close, %g, from which the weight "
                            "would be raised",
                            arguments_.fit.lambda_far, arguments_.fit.lambda_close));
  if (arguments_.template_mesh.path.empty()) {
    repair_to_fill(target_, arguments_.template_fit.regions, warnings_);
    // Checked before minutes are spent on making one.
    require_resumable(run_, run_identity(verb_, identity_of_target()));
  }
  tell_warnings();
}

void SubdivisionFitRun::load_template() {
  AutomaticFitOptions options = arguments_.template_fit;
  options.control.time_limit_seconds = kTemplateShareOfTime * arguments_.fit.control.time_limit_seconds;
  LoadedTemplate loaded = cli::load_template(arguments_.template_mesh, target_, options, arguments_.run, warnings_);
  template_mesh_ = std::move(loaded.mesh);
  if (has_few_inverted_cells(template_mesh_))
    untangle_template(
        arguments_.template_mesh.path, arguments_.run,
        {.control = {.time_limit_seconds = arguments_.fit.control.time_limit_seconds}, .tuning = arguments_.fit.tuning},
        template_mesh_, warnings_);
  made_ = std::move(loaded.made);
  require_regions(outputs_, regions_of(template_mesh_));
  FittedTarget fitted = fitted_target(target_, template_mesh_);
  regions_ = std::move(fitted.regions);
  outer_ = std::move(fitted.outer);
  if (!made_) warn_of_losses(marks_of(template_mesh_), marks_of(template_mesh_), outputs_, warnings_);
  tell_warnings();
  if (made_ && !arguments_.run.quiet) std::cerr << template_text(*made_);
}

void SubdivisionFitRun::fit() {
  FitOptions options = arguments_.fit;
  options.keep_states = has_animation(outputs_);
  options.frees_mesh = frees_mesh();
  std::vector<std::pair<std::string, std::string>> inputs = identity_of_target();
  inputs.emplace_back("template", fingerprint(template_mesh_));
  checkpointing_.emplace(run_, run_identity(verb_, inputs));
  options.control.log = checkpointing_->log();
  options.memory_limit_bytes = static_cast<double>(run_.memory_limit);
  // Making the template may have used part of the time limit.
  if (options.control.time_limit_seconds > 0)
    options.control.time_limit_seconds = std::max(1e-3, options.control.time_limit_seconds - seconds());
  result_ = followed(options.control, [&] {
    return std::visit([&](const auto& target) { return fit_subdivision_volume(target, template_mesh_, options); },
                      target_);
  });
  checkpointing_->finish(result_.report.warnings);
  constexpr std::size_t kFarMore = 2;  // times the cells asked for; templates have about as many as they should
  if (arguments_.cells && has_cage() && result_.mesh.num_cells() > kFarMore * *arguments_.cells)
    result_.report.warnings.push_back(internal::formatted(
        "the result has %zu cells, though %zu were asked for: its template has %zu, and --levels %d subdivides "
        "these; ask for fewer levels",
        result_.mesh.num_cells(), *arguments_.cells, template_mesh_.num_cells(), options.levels));
  add_warnings(result_.report.warnings);
  groups_ = carry_groups(outer_, result_.mesh);
  if (has_cage()) carry_groups(outer_, result_.cage);
  add_warnings(groups_.warnings);
  add_warnings_of_names(marks_of(result_.mesh));
}

void SubdivisionFitRun::write() {
  WritingOptions writing = arguments_.writing;
  writing.source = arguments_.target;
  writing.options = options_of_result(verb_);
  write_results(result_.cage, result_.mesh, result_.states, writing);
}

void SubdivisionFitRun::check() {
  const std::optional<VolumeMesh> written = written_cells(outputs_);
  const VolumeMesh& mesh = written ? *written : result_.mesh;
  std::visit(
      [&](const auto& target) {
        mesh_check_ = watched([&](auto progress) { return check_mesh(mesh, &target, {.progress = progress}); });
      },
      outer_);
  if (has_cage()) measure_limit(result_.cage, outer_, arguments_.writing);
  hold_to({.mean_percent = arguments_.fit.tolerance_percent}, mesh_check_, result_.report);
  hold_to_quality(arguments_.quality_floor, mesh_check_, result_.report);
  add_warnings(warnings_of_quality(arguments_.fit.quality, mesh_check_));
  add_warnings(warnings_of_volumes(mesh_check_, regions_));
  if (has_cage() && arguments_.fit.surface == FittedSurface::limit)
    hold_to(arguments_.fit.tolerance_percent, "the limit surface's mean",
            limit_.mean_percent(mesh_check_.target_diagonal), result_.report);
}

Json SubdivisionFitRun::report() const {
  const FitReport& report = result_.report;
  Json json{{"subvol", version()},
            {"command", "fit"},
            {"options", options_in_force(verb_)},
            {"input",
             {{"target", describe(arguments_.target, target_)},
              {"template", describe(arguments_.template_mesh.path, template_mesh_)}}}};
  if (made_) json["template"] = automatic_fit_json(*made_).at("template");
  json.update(fit_json(report));
  json.update(check_json(mesh_check_));
  if (mesh_check_.regions) json["regions"] = regions_json(*mesh_check_.regions, regions_, template_mesh_);
  if (!groups_.groups.empty()) json["groups"] = groups_json(groups_.groups);
  if (report.creases) json["creases"] = creases_json(*report.creases);
  if (has_cage()) json.update(cage_json(result_.cage, limit_, mesh_check_.target_diagonal));
  checkpointing_->describe(json);
  json["audit"] = audit_json(audit(template_mesh_));
  return json;
}

void SubdivisionFitRun::summarize() const {
  const FitReport& report = result_.report;
  std::cerr << to_string(report.stop_reason) << ": " << report.explanation << '\n' << to_text(mesh_check_);
  if (has_cage()) std::cerr << to_text(limit_, mesh_check_.target_diagonal);
  if (report.creases) std::cerr << to_text(*report.creases);
  tell_outputs();
}

int SubdivisionFitRun::run() {
  prepare({Part::cage, Part::cutaway, Part::animation, Part::boundary, Part::region});
  timed("read", &SubdivisionFitRun::load);
  timed("template", &SubdivisionFitRun::load_template);
  if (template_mesh_.num_cells() == 0) return kInterrupted;  // nothing has been fitted yet
  timed("fit", &SubdivisionFitRun::fit);
  timed("write", &SubdivisionFitRun::write);
  timed("check", &SubdivisionFitRun::check);
  write_report(report(), seconds_json(result_.report));
  if (!arguments_.run.quiet) summarize();
  require_outputs();
  return status(result_.report, mesh_check_.valid());
}

}  // namespace

int run_subdivision_fit(const SubdivisionFitArguments& arguments, const CLI::App& verb) {
  return SubdivisionFitRun(arguments, verb).run();
}

}  // namespace subvol::cli
