// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/solver/fit_problem.h"
#include "fit/solver/minimizer.h"
#include "fit/stages/fit_options.h"
#include "fit/stages/fit_report.h"
#include "fit/stages/stage.h"
#include "fit/stages/stage_log.h"
#include "subvol/surface/triangle_mesh.h"

#include <chrono>
#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace subvol {

/// Runs the minimisations of a fit one after the other, with one clock and one report.
class StageRunner {
 public:
  /// What the fit's options say of all stages.
  struct Options {
    SolverKind solver = SolverKind::newton;
    int max_iterations = 0;         ///< 0: the stage's own
    double time_limit_seconds = 0;  ///< 0: none
    std::function<bool(const FitProgress&)> progress;
    std::function<bool()> cancelled;
    StageLog* log = nullptr;        ///< null: none is kept
  };

  explicit StageRunner(Options options) : options_(std::move(options)) {}

  /// Minimises over x and appends the record, whose name, level or order, and cells are set, to the report. `fraction`
  /// is told to whoever follows the progress. False, with the report's stop reason set, when the fit must end.
  ///
  /// Where the log knows the result nothing is minimised, but the cells that were given a denser quadrature get it, so
  /// that the same problem may be solved twice: correspondences are forgotten at the start. Who looks at them
  /// afterwards must call `SurfaceTerm::forget` before.
  bool run(FitProblem& problem, const Stage& stage, StageRecord record, double fraction, std::vector<Vec3>& x,
           FitReport& report) const;

  /// Asked before work that takes long. False, with the report's stop reason set, where the time is over.
  bool in_time(const std::string& work, FitReport& report) const;

  /// The pairs of triangles of a fitted boundary that intersect. None, with the report's stop reason set, where the fit
  /// must end: the search was given up.
  std::optional<std::size_t> intersecting_pairs(const TriangleMesh& boundary, FitReport& report) const;

  /// Says how a fit ended whose stages are all done, at this mean distance.
  void conclude(double mean_percent, std::optional<double> tolerance_percent, FitReport& report) const;

  /// Whether what is under way is to be given up: the time is over, or the caller wants an end.
  bool is_to_end() const { return is_over() || (options_.cancelled && options_.cancelled()); }

  double seconds() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }

 private:
  using Clock = std::chrono::steady_clock;

  bool is_over() const { return options_.time_limit_seconds > 0 && seconds() > options_.time_limit_seconds; }
  /// Says that the fit must end in the midst of such work.
  void give_up(const std::string& work, FitReport& report) const;
  /// From the stage's x, and what was done to get there, on.
  void solve(FitProblem& problem, MinimizerOptions minimizer, SolvedStage& stage) const;

  Options options_;
  Clock::time_point start_ = Clock::now();
};

}  // namespace subvol
