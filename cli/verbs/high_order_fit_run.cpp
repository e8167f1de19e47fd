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
#include "cli/runs/report.h"
#include "cli/runs/untangling.h"
#include "cli/runs/written_result.h"
#include "cli/verbs/long_run.h"
#include "cli/verbs/verb_options.h"
#include "subvol/base/error.h"
#include "subvol/base/version.h"
#include "subvol/fit/mesh_check.h"
#include "subvol/fit/quality/high_order_quality.h"
#include "subvol/fit/quality/quality.h"
#include "subvol/fit/stages/fit_report.h"
#include "subvol/mesh/pyramids.h"
#include "subvol/templates/voxel_grid.h"

#include <algorithm>
#include <iostream>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace subvol::cli {
namespace {

/// Refuses, before the work, outputs to which no curved mesh can be written; the template's cells represent the result.
void refuse_impossible(const std::vector<Output>& outputs, const VolumeMesh& cells, int order) {
  internal::require_no_pyramids(cells.kinds, "template mesh: pyramids cannot be curved");
  for (const Output& output : outputs) require_for_curved_cells(output, kind_orders(cells.kinds, order));
}

/// Adds lambda, whose default depends on the template.
Json options_used(const HighOrderFitArguments& arguments, double lambda_close, Json options) {
  options[arguments.untangles ? "lambda" : "lambda-close"] = lambda_close;
  return options;
}

/// One run of `fit --order` or `optimize --order`, from its input files to its output files.
class HighOrderFitRun : public LongRun {
 public:
  HighOrderFitRun(const HighOrderFitArguments& arguments, const CLI::App& verb)
      : LongRun(arguments.run, verb), arguments_(arguments) {}
  int run();

 private:
  void load_target();
  /// Reads or makes the template, and untangles it. If it has no cells afterwards, the run was interrupted.
  void prepare_template();
  void require_fitting_template() const;
  void describe_input();
  void untangle();
  void fit();
  void write();
  void check();
  MeshCheck checked(const HighOrderMesh& mesh) const;
  /// Checks the linear cells that were written in place of the curved ones, if there is such a file.
  void check_linear();
  Json report() const;
  void summarize() const;

  const HighOrderFitArguments& arguments_;
  Target target_;
  LoadedTemplate template_;
  Json input_;
  std::optional<Checkpointing> checkpointing_;
  std::optional<HighOrderFitResult> result_;
  WritingOptions writing_;
  std::optional<HighOrderFile> file_;  ///< the result, as it is written
  FittedTarget fitted_;
  GroupsFound groups_;
  MeshCheck mesh_check_;
  std::vector<PolynomialCells> polynomials_;
  std::optional<MeshCheck> linear_;
};

void HighOrderFitRun::load_target() {
  target_ = arguments_.takes_points ? load_target_with_regions(arguments_.target, warnings_)
                                    : Target(load_surface(arguments_.target, warnings_));
  require_fitting_options(verb_, is_cloud(target_));
  if (const auto* surface = std::get_if<TriangleMesh>(&target_)) warn_of_missing_groups(verb_, *surface, warnings_);
  if (!arguments_.template_mesh.path.empty()) return;
  // Made templates consist of hexes, and making one takes minutes.
  refuse_impossible(outputs_, voxel_mesh(box_grid(Vec3::Zero(), Vec3::Ones(), {1, 1, 1})), arguments_.fit.order);
  repair_to_fill(target_, arguments_.template_fit.regions, warnings_);
  require_resumable(run_, run_identity(verb_, {{"target", fingerprint(target_)}}));
}

void HighOrderFitRun::prepare_template() {
  AutomaticFitOptions making = arguments_.template_fit;
  making.control.time_limit_seconds = kTemplateShareOfTime * arguments_.fit.control.time_limit_seconds;
  template_ = load_template(arguments_.template_mesh, target_, making, run_, warnings_, TemplateUse::curved_cells);
  if (!template_.made) warn_of_losses(marks_of(template_.mesh), marks_of(template_.mesh), outputs_, warnings_, true);
  tell_warnings();
  if (template_.made && !run_.quiet) std::cerr << template_text(*template_.made);
  if (template_.mesh.num_cells() == 0) return;
  require_fitting_template();
  describe_input();
  checkpointing_.emplace(
      run_, run_identity(verb_, {{"target", fingerprint(target_)}, {"template", fingerprint(template_.mesh)}}));
  if (template_.curved || arguments_.untangles || has_few_inverted_cells(template_.mesh)) untangle();
}

void HighOrderFitRun::require_fitting_template() const {
  refuse_impossible(outputs_, template_.mesh,
                    std::max(arguments_.fit.order, template_.curved ? template_.curved->space.max_order() : 1));
  require_regions(outputs_, regions_of(template_.mesh));
  if (!template_.curved) return;
  const std::string& path = arguments_.template_mesh.path;
  if (is_cloud(target_)) throw UsageError(path + ": curved cells are drawn to a surface, not to points");
  const int order = template_.curved->space.max_order();
  if (verb_.count("--order") > 0 && arguments_.fit.order < order)
    throw UsageError("--order " + std::to_string(arguments_.fit.order) + ": " + path + " has cells of order " +
                     std::to_string(order) + ", and orders are not lowered");
}

void HighOrderFitRun::describe_input() {
  input_ = {{"target", describe(arguments_.target, target_)}};
  input_[arguments_.untangles ? "mesh" : "template"] = describe(arguments_.template_mesh.path, template_.mesh);
  if (arguments_.untangles && !run_.report.empty())
    input_["quality"] =
        quality_json(template_.curved ? internal::measure_quality(*template_.curved) : measure_quality(template_.mesh));
}

void HighOrderFitRun::untangle() {
  const OptimizeOptions options{
      .control = {.time_limit_seconds = arguments_.fit.control.time_limit_seconds, .log = checkpointing_->log()},
      .tuning = arguments_.fit.tuning};
  const std::string& path = arguments_.template_mesh.path;
  try {
    if (template_.curved)
      untangle_template(path, run_, options, template_.mesh, *template_.curved, warnings_);
    else
      untangle_template(path, run_, options, template_.mesh, warnings_);
  } catch (const EndedEarly&) {
    checkpointing_->finish(warnings_);
    tell_warnings();
    throw;
  }
}

void HighOrderFitRun::fit() {
  HighOrderFitOptions options = arguments_.fit;
  options.control.log = checkpointing_->log();
  options.keep_states = has_animation(outputs_);
  if (options.control.time_limit_seconds > 0)
    options.control.time_limit_seconds = std::max(1e-3, options.control.time_limit_seconds - seconds());
  result_ = followed(options.control, [&] {
    if (template_.curved)
      return fit_high_order(std::get<TriangleMesh>(target_), *template_.curved, template_.mesh, options);
    return std::visit([&](const auto& target) { return fit_high_order(target, template_.mesh, options); }, target_);
  });
  checkpointing_->finish(warnings_);
  add_warnings(result_->report.warnings);
}

void HighOrderFitRun::write() {
  writing_ = arguments_.writing;
  writing_.source = arguments_.target;
  writing_.options = options_used(arguments_, result_->lambda_close, options_of_result(verb_));
  const VolumeMesh& labels = template_.mesh;
  file_.emplace(HighOrderFile{std::move(result_->mesh), labels.references, labels.face_groups, labels.regions});
  fitted_ = fitted_target(target_, template_.mesh);
  groups_ = carry_groups(fitted_.outer, *file_);
  add_warnings(groups_.warnings);
  add_warnings_of_names(marks_of(*file_));
  write_each([&](const Output& output) {
    if (output.part == Part::animation)
      write_animation(output, file_->mesh, result_->states, writing_);
    else
      write_output(output, *file_, writing_);
  });
}

MeshCheck HighOrderFitRun::checked(const HighOrderMesh& mesh) const {
  const CurvedBoundary boundary = curved_boundary(mesh, measured_chord_percent(writing_));
  return watched([&](auto progress) {
    const MeshCheckOptions options{.labels = {file_->references, file_->regions}, .progress = progress};
    return std::visit([&](const auto& target) { return check_mesh(mesh, boundary, &target, options); }, fitted_.outer);
  });
}

void HighOrderFitRun::check() {
  FitReport& report = result_->report;
  const std::optional<HighOrderMesh> written = written_curved_cells(outputs_);
  mesh_check_ = checked(written ? *written : file_->mesh);
  hold_to({.mean_percent = arguments_.fit.tolerance_percent}, mesh_check_, report);
  hold_to_quality(arguments_.quality_floor, mesh_check_, report);
  polynomials_ = check_polynomial_cells(outputs_, file_->mesh, writing_.map_tolerance_percent,
                                        [&](const HighOrderMesh& mesh) { return checked(mesh); });
  add_warnings(warnings_of_quality(arguments_.fit.quality, mesh_check_));
  add_warnings(warnings_of_volumes(mesh_check_, fitted_.regions));
  for (const PolynomialCells& cells : polynomials_) {
    hold_to({.mean_percent = arguments_.fit.tolerance_percent}, cells.check, report);
    add_warnings(polynomial_cells_warnings(cells));
  }
  check_linear();
}

void HighOrderFitRun::check_linear() {
  const std::optional<VolumeMesh> written = written_cells(outputs_);
  if (!written) return;
  linear_ = watched([&](auto progress) {
    return std::visit([&](const auto& target) { return check_mesh(*written, &target, {.progress = progress}); },
                      fitted_.outer);
  });
  add_warnings(linear_cells_warnings(*linear_));
  const bool stands_alone = std::none_of(outputs_.begin(), outputs_.end(), holds_polynomial_cells);
  if (stands_alone) hold_to({.mean_percent = arguments_.fit.tolerance_percent}, *linear_, result_->report);
}

Json HighOrderFitRun::report() const {
  const FitReport& report = result_->report;
  Json json{{"subvol", version()},
            {"command", arguments_.command},
            {"options", options_used(arguments_, result_->lambda_close, options_in_force(verb_))},
            {"input", input_},
            {"mesh", describe("", file_->mesh)}};
  json.update(fit_json(report));
  json.update(check_json(mesh_check_));
  if (report.creases) json["creases"] = creases_json(*report.creases);
  if (mesh_check_.regions) json["regions"] = regions_json(*mesh_check_.regions, fitted_.regions, template_.mesh);
  if (!groups_.groups.empty()) json["groups"] = groups_json(groups_.groups);
  if (linear_) json["linear_cells"] = check_json(*linear_);
  if (!polynomials_.empty()) json["polynomial_cells"] = polynomial_cells_json(polynomials_);
  if (arguments_.untangles) json["not_certified_cells"] = not_certified_cells(mesh_check_);
  if (template_.made) json["template"] = automatic_fit_json(*template_.made).at("template");
  checkpointing_->describe(json);
  return json;
}

void HighOrderFitRun::summarize() const {
  const FitReport& report = result_->report;
  std::cerr << to_string(report.stop_reason) << ": " << report.explanation << '\n' << to_text(mesh_check_);
  if (report.creases) std::cerr << to_text(*report.creases);
  tell_outputs();
}

int HighOrderFitRun::run() {
  prepare({Part::cutaway, Part::animation, Part::boundary, Part::region});
  timed("read", &HighOrderFitRun::load_target);
  timed(arguments_.untangles ? "untangle" : "template", &HighOrderFitRun::prepare_template);
  if (template_.mesh.num_cells() == 0) return kInterrupted;  // nothing has been fitted yet
  timed("fit", &HighOrderFitRun::fit);
  timed("write", &HighOrderFitRun::write);
  timed("check", &HighOrderFitRun::check);
  write_report(report(), seconds_json(result_->report));
  if (!run_.quiet) summarize();
  require_outputs();
  const int of_fit = status(result_->report, mesh_check_.valid() && (!linear_ || linear_->valid()));
  return of_fit == kDone ? polynomial_cells_status(polynomials_) : of_fit;
}

}  // namespace

int run_high_order_fit(const HighOrderFitArguments& arguments, const CLI::App& verb) {
  return HighOrderFitRun(arguments, verb).run();
}

}  // namespace subvol::cli
