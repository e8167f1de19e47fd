// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/solver/fit_problem.h"
#include "subvol/fit/solver/minimizer.h"
#include "subvol/fit/stages/fit_options.h"
#include "subvol/fit/stages/fit_report.h"
#include "subvol/fit/stages/solve_control.h"
#include "subvol/fit/stages/stage.h"
#include "subvol/fit/stages/stage_log.h"
#include "subvol/fit/stages/work_share.h"
#include "subvol/fit/tuning/tuning.h"
#include "subvol/surface/triangle_mesh.h"

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace subvol::internal {

/// Runs the minimizations of a fit one after the other, with one clock and one report.
class StageRunner {
 public:
  /// tuning  only its numbers of minimizers are used: the damping of Levenberg-Marquardt, and the stiffening of Newton.
  explicit StageRunner(SolveControl control, SolverKind solver = SolverKind::newton, const Tuning& tuning = {})
      : control_(std::move(control)), solver_(solver), tuning_(tuning) {}

  /// Returns a runner with the same limits, callbacks, clock and share of work, but without the log.
  StageRunner without_log() const {
    StageRunner result = *this;
    result.control_.log = nullptr;
    return result;
  }

  /// Minimizes over x and appends the record to the report. The record's name, level or order, and number of cells must
  /// be set. Each step is counted as `step_work` in `work()`, whose share is passed on to the progress callback. If the
  /// fit must end, sets the report's stop reason and returns false.
  ///
  /// If the log holds the result, nothing is minimized, and only the recorded quadrature refinements are repeated. To
  /// make both cases alike, correspondences are reset at the start; call `SurfaceTerm::forget` before inspecting them
  /// afterwards.
  bool run(FitProblem& problem, const Stage& stage, StageRecord record, std::vector<Vec3>& x, FitReport& report,
           double step_work = 1) const;

  /// The share of the whole work that is done. Its parts are begun by the fit, with their expected numbers of steps.
  WorkShare& work() const { return *work_; }

  /// Checks the time limit before long work. If the time is over, sets the report's stop reason and returns false.
  bool in_time(const std::string& work, FitReport& report) const;

  /// Returns the number of intersecting triangle pairs of a fitted boundary. If the search was interrupted and the fit
  /// must end, sets the report's stop reason and returns nothing.
  /// marked  as for `self_intersections`.
  std::optional<std::size_t> intersecting_pairs(const TriangleMesh& boundary, FitReport& report,
                                                std::span<const std::uint8_t> marked = {}) const;

  /// Sets the report's stop reason and explanation for a fit that has run all its stages, given its mean distance.
  void conclude(double mean_percent, std::optional<double> tolerance_percent, FitReport& report) const;

  /// Sets the report's stop reason, time limit or cancellation, for `work` that was interrupted.
  void give_up(const std::string& work, FitReport& report) const;

  /// Returns true if the current work must be interrupted: the time is over, or the caller cancels.
  bool is_to_end() const { return is_over() || (control_.cancelled && control_.cancelled()); }

  double seconds() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }

 private:
  using Clock = std::chrono::steady_clock;

  bool is_over() const { return control_.time_limit_seconds > 0 && seconds() > control_.time_limit_seconds; }
  /// Minimizes from the stage's x, continuing the steps that its result already records.
  void solve(FitProblem& problem, MinimizerOptions minimizer, SolvedStage& stage) const;

  SolveControl control_;
  SolverKind solver_;
  Tuning tuning_;
  Clock::time_point start_ = Clock::now();
  std::shared_ptr<WorkShare> work_ = std::make_shared<WorkShare>();  ///< never null; the same one in all copies
};

/// Sets the report's stop reason and explanation for a fit that is done: only a tolerance may be missed.
void conclude_by_distance(double mean_percent, std::optional<double> tolerance_percent, FitReport& report);

}  // namespace subvol::internal
