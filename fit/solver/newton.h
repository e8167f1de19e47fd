// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/solver/fit_problem.h"
#include "subvol/fit/solver/minimizer.h"

#include <vector>

namespace subvol::internal {

/// Newton's method with frozen correspondences and conjugate gradients, preconditioned by the 3x3 diagonal blocks of
/// the pulled-back Hessian. Each step decreases E and keeps every certified cell certified (`VolumeTerm`). The
/// quadrature of cells that block a step is refined for later steps. If points limit a step to less than a half, or
/// cells block it, the Hessian is made stiffer there (`VolumeTerm::stiffen`) and a new direction is found, so that they
/// stay nearly as they are and the rest moves on.
///
/// x  feasible start (finite E), else `infeasible_start`; receives the result. With `begun`, x as passed to `keep`: the
///    minimization then ends at the same bits as the interrupted one would have. The problem must be in the same state
///    as at the start of that one. InputError: as for `densify_again`.
MinimizerResult minimize_newton(FitProblem& problem, std::vector<Vec3>& x, const MinimizerOptions& options);

}  // namespace subvol::internal
