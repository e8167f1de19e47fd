// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"

#include <span>
#include <vector>

namespace subvol::internal {

/// Anderson acceleration of a descent method whose steps f(x) converge linearly: "type I", in which the products of
/// steps and gradients take the place of a norm, so that no metric has to be chosen.
///
///   (dx_i . dg_j) gamma = (dx_i . g_k)
///   step = f_k - sum_j gamma_j (dx_j + df_j)
///
/// x_k, f_k, g_k    state, step of the method from there, and gradient there, as added last
/// dx, df, dg       differences of successive x, f and g; up to kMostDifferences of them are kept
///
/// Source: docs/references.md, Acceleration. Results have the same bits for any number of threads.
class AndersonMemory {
 public:
  static constexpr int kMostDifferences = 5;  ///< 3 and 8 gave the same results in the same number of steps

  void clear();
  /// Adds a state; all three have the same size in every call.
  void add(std::span<const Vec3> x, std::span<const Vec3> f, std::span<const Vec3> g);
  /// Writes the accelerated step. Returns false, with `step` unchanged, if fewer than two states are known or the
  /// system is singular.
  bool find_step(std::vector<Vec3>& step) const;

 private:
  struct Difference {
    std::vector<Vec3> x, f, g;
  };
  Difference last_;                  ///< the state added last, not a difference; empty: none
  std::vector<Difference> history_;  ///< oldest first
};

}  // namespace subvol::internal
