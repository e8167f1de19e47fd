// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"

#include <algorithm>
#include <array>
#include <span>

namespace subvol::internal {

/// sum_i a_i . b_i over arrays of points of equal size. Fixed slices, summed in order: same bits for any thread count.
inline double dot(std::span<const Vec3> a, std::span<const Vec3> b) {
  constexpr std::size_t kDotProductSlices = 64;  // more than any machine's threads that help at this
  std::array<double, kDotProductSlices> sums{};
#pragma omp parallel for schedule(static)
  for (std::size_t s = 0; s < kDotProductSlices; ++s) {
    double sum = 0;
    for (std::size_t i = a.size() * s / kDotProductSlices; i < a.size() * (s + 1) / kDotProductSlices; ++i)
      sum += a[i].dot(b[i]);
    sums[s] = sum;
  }
  double total = 0;
  for (double s : sums) total += s;
  return total;
}

/// y += alpha x.
inline void add_scaled(double alpha, std::span<const Vec3> x, std::span<Vec3> y) {
#pragma omp parallel for schedule(static)
  for (std::size_t i = 0; i < x.size(); ++i) y[i] += alpha * x[i];
}

}  // namespace subvol::internal
