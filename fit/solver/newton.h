// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/solver/fit_problem.h"
#include "fit/solver/minimizer.h"

#include <vector>

namespace subvol {

/// Newton's method with frozen correspondences and conjugate gradients, preconditioned by the 3x3 diagonal blocks of
/// the pulled-back Hessian. Each step keeps E decreasing and every cell that is certified (`VolumeTerm`) certified;
/// cells that stand in the way get a denser quadrature for the steps to come. Where few points would make the step
/// shorter than a half, or cells stand in its way, the Hessian is made stiffer there (`VolumeTerm::stiffen`) and the
/// direction found again, so that they stay nearly as they are and the rest moves on.
///
/// x  feasible start (finite E), else `infeasible_start`; receives the result. With `begun`, where that was kept: it
///    then ends at the same bits as the minimisation that was interrupted would have. The problem must be as it was at
///    the start of that one, else InputError where a cell does not exist.
MinimizerResult minimize_newton(FitProblem& problem, std::vector<Vec3>& x, const MinimizerOptions& options);

}  // namespace subvol
