// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace subvol::internal {

/// Settings of one minimization: its weights and its stop tests.
struct Stage {
  double lambda, tangential_weight;
  int max_iterations = 20;
  double relative_decrease = 1e-3;
  /// Longest move of a node in one step, as a share of the target's diagonal, if the energy of the cells is a sum of
  /// squares, which the Levenberg-Marquardt method minimizes. 0: the fit's own solver does.
  double longest_move = 0;
  double first_damping = 1e-3;  ///< of that method
  bool spares_most = true;      ///< the same: shortens steps at few cells first (`MinimizerOptions`)
  /// Newton's method: relative tolerance of its linear systems, and steps for which the cells' Hessian is kept.
  double linear_tolerance = 0.1;
  int hessian_life = 1;
  bool accelerates = false;  ///< whether steps are accelerated (`MinimizerOptions`)
};

/// Number of L-BFGS steps that replace one Newton step of a stage.
inline constexpr int kLbfgsSteps = 30;

}  // namespace subvol::internal
