// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"

#include <Eigen/Geometry>

#include <array>
#include <atomic>
#include <cmath>

namespace subvol::internal {

/// Finds the largest t = limit * 0.8^n, n <= 200, such that every det(J + s D), 0 <= s <= t, keeps at least a tenth of
/// det J, over all admitted pairs (J, D). Several threads may admit pairs at once; t does not depend on their order.
class StepLimit {
 public:
  explicit StepLimit(double limit) {
    for (int n = 0; n <= kMostStepReductions; ++n) step_[n] = limit * std::pow(kStepReduction, n);
  }

  void admit(const Mat3& j, const Mat3& d) {
    const Path path(j, d);
    int n = steps_.load(std::memory_order_relaxed);
    while (n < kMostStepReductions && !path.safe(step_[n])) ++n;
    int seen = steps_.load(std::memory_order_relaxed);
    while (seen < n && !steps_.compare_exchange_weak(seen, n)) {
    }
  }

  double step() const { return step_[steps_.load()]; }

  /// True if det(J + s D) is shown to keep at least a tenth of det J for all s in [0, t].
  static bool safe(const Mat3& j, const Mat3& d, double t) { return Path(j, d).safe(t); }

 private:
  /// det(J + t D) - kKeptDeterminantShare det J = c0 + c1 t + c2 t^2 + c3 t^3. It is positive on [0, t] if its four
  /// Bernstein coefficients there are; the first of them is c0, positive because det J > 0.
  struct Path {
    double c0, c1, c2, c3;
    Path(const Mat3& j, const Mat3& d) {
      const Vec3 j12 = j.col(1).cross(j.col(2)), d12 = d.col(1).cross(d.col(2));
      const Vec3 mixed = j.col(1).cross(d.col(2)) + d.col(1).cross(j.col(2));
      c0 = (1 - kKeptDeterminantShare) * j.col(0).dot(j12);
      c1 = d.col(0).dot(j12) + j.col(0).dot(mixed);
      c2 = d.col(0).dot(mixed) + j.col(0).dot(d12);
      c3 = d.col(0).dot(d12);
    }
    bool safe(double t) const {
      const double a1 = c1 * t, a2 = c2 * t * t, a3 = c3 * t * t * t;
      return c0 + a1 / 3 > 0 && c0 + 2 * a1 / 3 + a2 / 3 > 0 && c0 + a1 + a2 + a3 > 0;
    }
  };
  // Ratio of successive steps, and the share of a determinant that a step must leave.
  static constexpr double kStepReduction = 0.8, kKeptDeterminantShare = 0.1;
  static constexpr int kMostStepReductions = 200;
  std::array<double, kMostStepReductions + 1> step_;  // a table, so that all threads use the same bits of a step
  std::atomic<int> steps_{0};                         // step_[steps_] is safe for every pair seen so far
};

}  // namespace subvol::internal
