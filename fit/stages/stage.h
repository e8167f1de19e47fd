// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace subvol {

/// Settings of one minimization: its weights and its stop tests.
struct Stage {
  double lambda, tangential_weight;
  int max_iterations = 20;
  double relative_decrease = 1e-3;
};

/// Number of L-BFGS steps that replace one Newton step of a stage.
inline constexpr int kLbfgsSteps = 30;

}  // namespace subvol
