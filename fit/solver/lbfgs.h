// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/solver/fit_problem.h"
#include "fit/solver/minimizer.h"

#include <vector>

namespace subvol {

/// The reference that Newton is measured against, and the paper's algorithm 2: L-BFGS (m = 10) with a weak Wolfe line
/// search by bisection, which takes +infinity as too long a step. Correspondences are exact at every evaluation.
/// Converged where ten steps decrease E by less than `relative_decrease`.
MinimizerResult minimize_lbfgs(FitProblem& problem, std::vector<Vec3>& x, const MinimizerOptions& options);

}  // namespace subvol
