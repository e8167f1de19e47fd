// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/verbs/optimize_run.h"

#include "cli/runs/check_report.h"
#include "cli/runs/checkpointing.h"
#include "cli/runs/exit_status.h"
#include "cli/runs/face_groups.h"
#include "cli/runs/interrupt.h"
#include "cli/runs/loading.h"
#include "cli/runs/losses.h"
#include "cli/runs/outputs.h"
#include "cli/runs/report.h"
#include "cli/runs/written_result.h"
#include "cli/verbs/high_order_fit_run.h"
#include "cli/verbs/long_run.h"
#include "cli/verbs/optimize_curved_run.h"
#include "cli/verbs/verb_options.h"
#include "subvol/base/version.h"
#include "subvol/fit/geometry/boundary_triangles.h"
#include "subvol/fit/mesh_check.h"
#include "subvol/fit/quality/quality.h"
#include "subvol/surface/boundary.h"

#include <algorithm>
#include <iostream>
#include <optional>
#include <utility>
#include <variant>
#include <vector>

namespace subvol::cli {

using namespace internal;

namespace {

/// Curves a mesh by fitting curved elements with the mesh as the template.
HighOrderFitArguments curving_arguments(const OptimizeArguments& arguments, const CLI::App& verb) {
  HighOrderFitArguments result{
      arguments.run, arguments.writing, {}, arguments.target, {arguments.mesh, std::nullopt}, "optimize", true, false};
  HighOrderFitOptions& fit = result.fit;
  fit.order = arguments.order;
  fit.basis = arguments.basis == "legendre" ? Basis::legendre : Basis::fourier;
  fit.tolerance_percent = arguments.optimize.mean_tolerance_percent;
  fit.quality = arguments.optimize.quality;
  fit.crease_angle_degrees = arguments.optimize.crease_angle_degrees;
  fit.follows_all_edges = verb.count("--crease-angle") > 0;
  fit.lambda_close = verb.count("--lambda") > 0 ? arguments.optimize.lambda : kCurvingLambda;
  fit.control = arguments.optimize.control;
  fit.memory_limit_bytes = static_cast<double>(arguments.run.memory_limit);
  fit.tuning = arguments.optimize.tuning;
  return result;
}

/// One run of `optimize`, from its input files to its output files.
class OptimizeRun : public LongRun {
 public:
  OptimizeRun(const OptimizeArguments& arguments, const CLI::App& verb)
      : LongRun(arguments.run, verb), arguments_(arguments) {}
  int run();

 private:
  void load();
  void optimize();
  void write();
  void check();
  Json report() const;
  void summarize() const;

  const OptimizeArguments& arguments_;
  std::optional<HighOrderFile> curved_;  ///< the mesh, if its cells are curved: then `CurvedOptimizeRun` goes on
  VolumeMesh mesh_;
  std::optional<TriangleMesh> target_;
  TriangleMesh surface_;  ///< compared with the boundary: the target, or the original boundary
  QualityReport before_;
  std::optional<Checkpointing> checkpointing_;
  OptimizeResult result_;
  GroupsFound groups_;
  MeshCheck mesh_check_;
};

void OptimizeRun::load() {
  LoadedCells cells = load_cells(arguments_.mesh, warnings_, true, arguments_.run.references);
  if (auto* curved = std::get_if<HighOrderFile>(&cells)) {
    curved_ = std::move(*curved);
    return;
  }
  mesh_ = std::get<VolumeMesh>(std::move(cells));
  require_regions(outputs_, regions_of(mesh_));
  warn_of_losses(marks_of(mesh_), marks_of(mesh_), outputs_, warnings_);
  if (!arguments_.target.empty())
    target_ = std::get<TriangleMesh>(outer_target(load_surface(arguments_.target, warnings_), mesh_));
  surface_ = target_ ? *target_ : fan_triangles(boundary_surface(mesh_, MeshTopology(mesh_)));
  before_ = measure_quality(mesh_);
  tell_warnings();
}

void OptimizeRun::optimize() {
  OptimizeOptions options = arguments_.optimize;
  options.sizes = arguments_.sizes == "uniform" ? CellSizes::uniform : CellSizes::local;
  std::vector<std::pair<std::string, std::string>> inputs{{"mesh", fingerprint(mesh_)}};
  if (target_) inputs.emplace_back("target", fingerprint(*target_));
  checkpointing_.emplace(run_, run_identity(verb_, inputs));
  options.control.log = checkpointing_->log();
  result_ = followed(options.control, [&] { return optimize_mesh(mesh_, target_ ? &*target_ : nullptr, options); });
  checkpointing_->finish(result_.report.warnings);
  add_warnings(result_.report.warnings);
  if (target_) groups_ = carry_groups(*target_, result_.mesh);
  add_warnings(groups_.warnings);
  add_warnings_of_names(marks_of(result_.mesh));
}

void OptimizeRun::write() {
  WritingOptions writing = arguments_.writing;
  writing.source = arguments_.mesh;
  writing.options = options_of_result(verb_);
  write_each([&](const Output& output) { write_output(output, result_.mesh, writing); });
}

void OptimizeRun::check() {
  const std::optional<VolumeMesh> written = written_cells(outputs_);
  const VolumeMesh& mesh = written ? *written : result_.mesh;
  mesh_check_ = watched([&](auto progress) { return check_mesh(mesh, &surface_, {.progress = progress}); });
  const OptimizeOptions& asked = arguments_.optimize;
  if (!asked.fixed_boundary)
    hold_to({asked.mean_tolerance_percent, asked.max_tolerance_percent}, mesh_check_, result_.report);
  add_warnings(warnings_of_quality(asked.quality, mesh_check_));
}

Json OptimizeRun::report() const {
  Json json{{"subvol", version()},
            {"command", "optimize"},
            {"options", options_in_force(verb_)},
            {"input", {{"mesh", describe(arguments_.mesh, mesh_)}, {"quality", quality_json(before_)}}}};
  if (target_) json["input"]["target"] = describe(arguments_.target, *target_);
  json.update(fit_json(result_.report));
  json.update(check_json(mesh_check_));
  if (mesh_check_.regions) {
    const RegionReport start = measure_regions(mesh_, &before_);
    json["regions"] = regions_json(*mesh_check_.regions, &start);
  }
  if (!groups_.groups.empty()) json["groups"] = groups_json(groups_.groups);
  if (result_.report.creases) json["creases"] = creases_json(*result_.report.creases);
  checkpointing_->describe(json);
  json["not_certified_cells"] = not_certified_cells(mesh_check_);
  return json;
}

void OptimizeRun::summarize() const {
  constexpr std::size_t kMostNamedUncertifiedCells = 10;
  std::cerr << to_string(result_.report.stop_reason) << ": " << result_.report.explanation << '\n'
            << "before: " << before_.inverted_cells << " cells inverted, scaled Jacobian min "
            << before_.min_scaled_jacobian << ", mean " << before_.mean_scaled_jacobian << '\n'
            << to_text(mesh_check_);
  if (result_.report.creases) std::cerr << to_text(*result_.report.creases);
  const std::vector<Index> left = not_certified_cells(mesh_check_);
  for (std::size_t i = 0; i < std::min(left.size(), kMostNamedUncertifiedCells); ++i)
    std::cerr << "cell " << left[i] << " is not proved positive\n";
  tell_outputs();
}

int OptimizeRun::run() {
  check_outputs({Part::cutaway, Part::boundary, Part::region});
  timed("read", &OptimizeRun::load);
  if (curved_ && !arguments_.target.empty()) {
    for (const char* option : {"--sizes", "--max-tolerance"})
      if (verb_.count(option) > 0) throw UsageError(std::string(option) + ": not for curved cells");
    return run_high_order_fit(curving_arguments(arguments_, verb_), verb_);
  }
  add_warnings(unused_output_options(verb_, outputs_));
  if (curved_) return CurvedOptimizeRun(arguments_, *this, *std::move(curved_)).run();
  timed("optimize", &OptimizeRun::optimize);
  timed("write", &OptimizeRun::write);
  timed("check", &OptimizeRun::check);
  write_report(report());
  if (!arguments_.run.quiet) summarize();
  require_outputs();
  return status(result_.report, mesh_check_.valid());
}

}  // namespace

int run_optimize(const OptimizeArguments& arguments, const CLI::App& verb) {
  if (arguments.order > 1) return run_high_order_fit(curving_arguments(arguments, verb), verb);
  return OptimizeRun(arguments, verb).run();
}

}  // namespace subvol::cli
