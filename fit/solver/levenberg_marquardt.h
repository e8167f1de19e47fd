// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/solver/fit_problem.h"
#include "subvol/fit/solver/minimizer.h"

#include <span>
#include <vector>

namespace subvol::internal {

/// The Levenberg-Marquardt method with frozen correspondences, for sums of squares whose Hessian is that of
/// Gauss-Newton (`QualityEnergy`).
///
///   (H + mu D) d = -g,   D_j = (mean of all t + t_j) / 2,  t_j: mean diagonal entry of block j of H
///
/// mu begins as the options say. A step that decreases E is taken; otherwise mu rises to 6 mu, and the step is found
/// again. If the first one was taken, mu falls to 0.3 mu, but not below 1e-4. A step is scaled down if a node would
/// move farther than `longest_move`.
///
/// A few cells must not stop all others, so a step is shortened only where it does harm. Before E is looked at, it is
/// halved at the vertices of cells that it ruins (`VolumeTerm::ruined`), up to ten times, then set to 0 there; at those
/// of cells that would lose their certificate it is set to 0. If E rises, the step is halved at the vertices of the
/// cells that account for half of all rises, up to eight times, before mu is raised, unless the option
/// `spares_most` is off. Where a step was shortened, mu has a factor that rises to 6 times its value for the next step;
/// elsewhere the factor falls to 0.3 times its value, but not below 1.
///
/// Options `accelerates`: the step that was found is replaced by an accelerated one (`AndersonMemory`) if that ruins no
/// cell and E, with correspondences found anew, is not higher.
///
/// x  start, receives the result. E must be finite there, else `infeasible_start`. With `begun`, x as passed to `keep`.
/// Converged if two steps in a row decrease E by less than `relative_decrease`; no_step: none of eight values of mu
/// gives a step that decreases E. Same bits for any number of threads.
MinimizerResult minimize_levenberg_marquardt(FitProblem& problem, std::vector<Vec3>& x,
                                             const MinimizerOptions& options);

/// Returns mu after these steps of a minimization that began with mu = `first`.
double damping_after(double first, std::span<const IterationRecord> steps, const QualityTuning& tuning = {});

}  // namespace subvol::internal
