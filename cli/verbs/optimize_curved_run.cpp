// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/verbs/optimize_curved_run.h"

#include "cli/runs/check_report.h"
#include "cli/runs/exit_status.h"
#include "cli/runs/interrupt.h"
#include "cli/runs/loading.h"
#include "cli/runs/report.h"
#include "cli/verbs/verb_options.h"
#include "subvol/base/error.h"
#include "subvol/base/version.h"
#include "subvol/fit/quality/high_order_quality.h"

#include <algorithm>
#include <iostream>
#include <utility>

namespace subvol::cli {

using namespace internal;

CurvedOptimizeRun::CurvedOptimizeRun(const OptimizeArguments& arguments, const LongRun& begun, HighOrderFile file)
    : LongRun(begun), arguments_(arguments), file_(std::move(file)), input_(describe(arguments.mesh, file_.mesh)) {
  for (const char* option : {"--sizes", "--crease-angle", "--tolerance", "--max-tolerance", "--lambda"})
    if (verb_.count(option) > 0)
      throw UsageError(std::string(option) + ": not for curved cells without --target, whose boundary keeps its shape");
  for (const Output& output : outputs_) require_for_curved_cells(output, kind_orders(file_.mesh.space));
  require_regions(outputs_, regions_of(labels_of(file_)));
  warn_of_losses(marks_of(file_), marks_of(file_), outputs_, warnings_, true);
}

void CurvedOptimizeRun::optimize() {
  before_ = measure_quality(file_.mesh);
  const OptimizeOptions& asked = arguments_.optimize;
  CurvedOptimizeOptions options{.fixed_boundary = asked.fixed_boundary,
                                .quality = asked.quality,
                                .control = asked.control,
                                .tuning = asked.tuning};
  const VolumeMesh labels = labels_of(file_);
  checkpointing_.emplace(run_, run_identity(verb_, {{"mesh", fingerprint(labels)}}));
  options.control.log = checkpointing_->log();
  CurvedOptimizeResult result = followed(options.control, [&] { return optimize_curved(file_.mesh, labels, options); });
  checkpointing_->finish(result.report.warnings);
  add_warnings(result.report.warnings);
  file_.mesh = std::move(result.mesh);
  add_warnings_of_names(marks_of(file_));
  fit_ = std::move(result.report);
}

void CurvedOptimizeRun::write() {
  WritingOptions writing = arguments_.writing;
  writing.source = arguments_.mesh;
  writing.options = options_of_result(verb_);
  write_each([&](const Output& output) { write_output(output, file_, writing); });
}

void CurvedOptimizeRun::check() {
  const std::optional<HighOrderMesh> written = written_curved_cells(outputs_);
  const auto check_curved = [&](const HighOrderMesh& mesh) {
    const CurvedBoundary boundary = curved_boundary(mesh, measured_chord_percent(arguments_.writing));
    return watched([&](auto progress) {
      return check_mesh(mesh, boundary, static_cast<const TriangleMesh*>(nullptr),
                        {.labels = {file_.references, file_.regions}, .progress = progress});
    });
  };
  mesh_check_ = check_curved(written ? *written : file_.mesh);
  add_warnings(warnings_of_quality(arguments_.optimize.quality, mesh_check_));
  polynomials_ = check_polynomial_cells(outputs_, file_.mesh, arguments_.writing.map_tolerance_percent, check_curved);
  for (const PolynomialCells& cells : polynomials_) add_warnings(polynomial_cells_warnings(cells));
  if (const std::optional<VolumeMesh> linear = written_cells(outputs_)) {
    linear_ = check_mesh(*linear);
    add_warnings(linear_cells_warnings(*linear_));
  }
}

Json CurvedOptimizeRun::report() const {
  Json json{{"subvol", version()},
            {"command", "optimize"},
            {"options", options_in_force(verb_)},
            {"input", {{"mesh", input_}, {"quality", quality_json(before_)}}},
            {"mesh", describe("", file_.mesh)}};
  json.update(fit_json(fit_));
  json.update(check_json(mesh_check_));
  checkpointing_->describe(json);
  json["not_certified_cells"] = not_certified_cells(mesh_check_);
  if (linear_) json["linear_cells"] = check_json(*linear_);
  if (!polynomials_.empty()) json["polynomial_cells"] = polynomial_cells_json(polynomials_);
  return json;
}

void CurvedOptimizeRun::summarize() const {
  std::cerr << to_string(fit_.stop_reason) << ": " << fit_.explanation << '\n'
            << "before: " << before_.certificate.not_certified.size() << " cells not certified, scaled Jacobian min "
            << before_.min_scaled_jacobian << ", mean " << before_.mean_scaled_jacobian << '\n'
            << to_text(mesh_check_);
  tell_outputs();
}

int CurvedOptimizeRun::run() {
  tell_warnings();
  timed("optimize", &CurvedOptimizeRun::optimize);
  timed("write", &CurvedOptimizeRun::write);
  timed("check", &CurvedOptimizeRun::check);
  write_report(report());
  if (!arguments_.run.quiet) summarize();
  require_outputs();
  const int of_cells = status(fit_, mesh_check_.valid() && (!linear_ || linear_->valid()));
  return of_cells == kDone ? polynomial_cells_status(polynomials_) : of_cells;
}

}  // namespace subvol::cli
