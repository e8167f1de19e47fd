// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace subvol {

/// One minimisation: weights, and when it ends.
struct Stage {
  double lambda, tangential_weight;
  int max_iterations = 20;
  double relative_decrease = 1e-3;
};

/// L-BFGS steps allowed for each Newton step of a stage.
inline constexpr int kLbfgsSteps = 30;

}  // namespace subvol
