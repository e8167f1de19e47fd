// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace subvol {

/// Reason why a minimization ended. infeasible_start: it ended at once, because E is infinite at the start.
enum class MinimizerStop { converged, iteration_limit, cancelled, no_step, infeasible_start };

/// One step of a minimizer.
struct IterationRecord {
  double surface_energy = 0, volume_energy = 0;  ///< E_S and E_W (dimensionless), E = E_S + lambda E_W   Paper: Eq. 1
  /// Accepted fraction of the search direction; 1 for Levenberg-Marquardt steps, which are shortened locally.
  double step_length = 0;
  int linear_iterations = 0;  ///< conjugate-gradient iterations of this step
  int evaluations = 0;  ///< energies of its line search; Levenberg-Marquardt: values of the damping that were tried
};

}  // namespace subvol
