// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/solver/fit_problem.h"
#include "subvol/fit/solver/minimizer.h"

#include <vector>

namespace subvol::internal {

/// The paper's algorithm 2, and the reference for Newton's method: L-BFGS (m = 10) with a weak Wolfe line search by
/// bisection, which treats +infinity as too long a step. Correspondences are found anew at every evaluation. If all
/// cells of the start are certified, they stay so. Converged if ten steps decrease E by less than `relative_decrease`.
MinimizerResult minimize_lbfgs(FitProblem& problem, std::vector<Vec3>& x, const MinimizerOptions& options);

}  // namespace subvol::internal
