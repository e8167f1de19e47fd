// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"
#include "subvol/fit/solver/iteration_record.h"
#include "subvol/fit/tuning/curved_tuning.h"
#include "subvol/fit/tuning/quality_tuning.h"

#include <functional>
#include <span>
#include <string>
#include <vector>

namespace subvol::internal {

struct FitProblem;

/// How a minimization ended, and its steps.
struct MinimizerResult {
  MinimizerStop stop;
  std::string explanation;  ///< the test that ended it, with its figure
  std::vector<IterationRecord> iterations;
  std::vector<std::vector<Index>> densified{};  ///< cells of each quadrature refinement, in order
  std::vector<Vec3> densified_at{};             ///< x at the last refinement; empty: there was none
  int small_steps = 0;                          ///< number of small decreases of E in a row at the end
};

/// Repeats the quadrature refinements of this result in the problem, so that E is the same function again.
/// InputError: `densified` and `densified_at` do not fit the problem.
void densify_again(FitProblem& problem, const MinimizerResult& result);

/// Share of the decrease that the slope promises which a step of a line search must reach: the usual one.
inline constexpr double kArmijo = 1e-4;

struct MinimizerOptions {
  int max_iterations = 20;
  double relative_decrease = 1e-3;  ///< converged if two steps in a row decrease E by less than this share of E
  double cg_tolerance = 0.1;        ///< relative, of the preconditioned residual
  int cg_max_iterations = 200;
  /// Newton's method only: steps for which the cells' Hessian is kept, 1 to 4. It changes slowly after the first steps,
  /// and what a step aims at is decided by the gradient, which is always that of the present state.
  int hessian_life = 1;
  /// Not for L-BFGS: steps are accelerated by what the last ones have shown (`AndersonMemory`), since frozen
  /// correspondences make the methods converge linearly.
  bool accelerates = false;
  /// Levenberg-Marquardt only: longest move of a node in one step, in the target's unit; 0: no limit.
  double longest_move = 0;
  QualityTuning damping{};                       ///< Levenberg-Marquardt only: how mu changes
  double first_damping = damping.first_damping;  ///< Levenberg-Marquardt only: mu of the first step, > 0
  /// Newton's method only: number of times that one step may stiffen the cells that block it.
  int most_stiffenings = CurvedTuning{}.most_stiffenings;
  /// Levenberg-Marquardt only: if E rises, the step is first shortened at the cells whose energy rises most, and damped
  /// only then. Not where these are the cells that have to move.
  bool spares_most = true;
  /// Called after each step; returns false to stop.
  std::function<bool(const IterationRecord&)> progress;
  /// Asked many times within a step, which may take long. If it returns true, the step is abandoned, and the
  /// minimization ends as cancelled with the result of the step before.
  std::function<bool()> ended;
  /// Not for L-BFGS: called every few steps with x and the result so far. These suffice to resume the
  /// minimization from there (`begun`).
  std::function<void(std::span<const Vec3> x, const MinimizerResult& so_far)> keep;
  const MinimizerResult* begun = nullptr;  ///< the result so far, as passed to `keep`; null: a new start
};

/// Returns the cells of `now` that are not in `before` (both ascending).
std::vector<Index> newly_failed(const std::vector<Index>& before, const std::vector<Index>& now);

/// Returns true, and marks the result as cancelled, if the caller asks for an end within a step.
bool has_ended(const MinimizerOptions& options, MinimizerResult& result);

/// Adds the record of a step to the result and reports it. Returns false, with the result marked as cancelled, if the
/// caller wants to stop.
bool record_step(const IterationRecord& record, const MinimizerOptions& options, MinimizerResult& result);

}  // namespace subvol::internal
