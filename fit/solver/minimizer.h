// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"

#include <functional>
#include <span>
#include <string>
#include <vector>

namespace subvol {

struct FitProblem;

/// Why one minimisation ended; infeasible_start: at once, for E is infinite there.
enum class MinimizerStop { converged, iteration_limit, cancelled, no_step, infeasible_start };

/// One Newton (or L-BFGS) step.
struct IterationRecord {
  double surface_energy = 0, volume_energy = 0;  ///< E_S and E_W (dimensionless), E = E_S + lambda E_W   Paper: Eq. 1
  double step_length = 0;                        ///< accepted fraction of the search direction
  int linear_iterations = 0;                     ///< CG iterations of this step
  int evaluations = 0;                           ///< energy evaluations of its line search
};

struct MinimizerResult {
  MinimizerStop stop;
  std::string explanation;  ///< the test that fired, with its figure
  std::vector<IterationRecord> iterations;
  std::vector<std::vector<Index>> densified{};  ///< cells that were given more quadrature points, in this order
  std::vector<Vec3> densified_at{};             ///< x when the last of them were; empty: none were
  int small_steps = 0;                          ///< how many of the last steps decreased E by next to nothing
};

/// Does to the problem's cells what was done to them on the way to this result, so that E is the same function again.
/// InputError: `densified` and `densified_at` are not those of such a problem.
void densify_again(FitProblem& problem, const MinimizerResult& result);

struct MinimizerOptions {
  int max_iterations = 20;
  double relative_decrease = 1e-3;  ///< converged when two steps in a row decrease E by less than this share of E
  double cg_tolerance = 0.1;        ///< of the preconditioned residual
  int cg_max_iterations = 200;
  /// Called after each step; returns false to stop.
  std::function<bool(const IterationRecord&)> progress;
  /// Asked many times within a step, which may be long; true: it is given up, and the minimisation ends as cancelled
  /// with the step before.
  std::function<bool()> ended;
  /// Newton's method only: called every few steps with x and what has been done so far, which is all that it takes to
  /// go on from there (`begun`).
  std::function<void(std::span<const Vec3> x, const MinimizerResult& so_far)> keep;
  const MinimizerResult* begun = nullptr;  ///< what was done to get to x, as `keep` was told; null: nothing
};

/// Ends the result as cancelled where the caller wants an end within a step.
bool has_ended(const MinimizerOptions& options, MinimizerResult& result);

/// Keeps the record of a step and tells the caller; false, with the result's stop set, when they want to end here.
bool record_step(const IterationRecord& record, const MinimizerOptions& options, MinimizerResult& result);

}  // namespace subvol
