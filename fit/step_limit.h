// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/types.h"

#include <Eigen/Geometry>

#include <array>
#include <atomic>
#include <cmath>

namespace subvol {

/// The largest t of a geometric sequence that starts at `limit` so that every det(J + s D), 0 <= s <= t, keeps at least a
/// tenth of det J, over all pairs (J, D) that were admitted. Pairs may come from many threads at once; same t for any.
class StepLimit {
 public:
  explicit StepLimit(double limit) {
    for (int n = 0; n <= kMaxSteps; ++n) step_[n] = limit * std::pow(kShrink, n);
  }

  void admit(const Mat3& j, const Mat3& d) {
    // det(J + t D) = c0 + c1 t + c2 t^2 + c3 t^3; positive on [0, t] if its four Bernstein coefficients there are.
    const Vec3 j12 = j.col(1).cross(j.col(2)), d12 = d.col(1).cross(d.col(2));
    const Vec3 mixed = j.col(1).cross(d.col(2)) + d.col(1).cross(j.col(2));
    const double c0 = (1 - kKept) * j.col(0).dot(j12), c1 = d.col(0).dot(j12) + j.col(0).dot(mixed),
                 c2 = d.col(0).dot(mixed) + j.col(0).dot(d12), c3 = d.col(0).dot(d12);
    int n = steps_.load(std::memory_order_relaxed);
    for (; n < kMaxSteps; ++n) {
      const double t = step_[n];
      const double a1 = c1 * t, a2 = c2 * t * t, a3 = c3 * t * t * t;
      if (c0 + a1 / 3 > 0 && c0 + 2 * a1 / 3 + a2 / 3 > 0 && c0 + a1 + a2 + a3 > 0) break;
    }
    int seen = steps_.load(std::memory_order_relaxed);
    while (seen < n && !steps_.compare_exchange_weak(seen, n)) {
    }
  }

  double step() const { return step_[steps_.load()]; }

 private:
  static constexpr double kShrink = 0.8, kKept = 0.1;
  static constexpr int kMaxSteps = 200;
  std::array<double, kMaxSteps + 1> step_;  // a table, so that a step has the same bits for every thread
  std::atomic<int> steps_{0};               // step_[steps_] is safe for every pair seen so far
};

}  // namespace subvol
