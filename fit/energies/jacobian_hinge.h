// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/simd/wide_matrix.h"

namespace subvol::internal {

/// How far the scaled Jacobians of eight Jacobians F fall short of a threshold t, and the derivative of that by F:
///
///   below = max(0, t - s),   s = det F / (|F e1| |F e2| |F e3|),   slope = -ds/dF where s < t, else 0
///
/// The penalty below^2 is the hinge of `QualityEnergy`. Its Gauss-Newton Hessian 2 slope slope^T is positive
/// semidefinite. If a column has no length, s is 0, and nothing is infinite.
struct JacobianHinge {
  Wide below;
  Wide slope[9];  ///< laid out like F, row by row

  /// f  nine entries, row by row.
  [[gnu::always_inline]] JacobianHinge(const Wide* f, double threshold) {
    constexpr double kTiny = 1e-300;  // squared length, so that no column is divided by zero
    Wide unit[9], length_squared[3];  // unit: columns divided by their lengths
    for (int c = 0; c < 3; ++c) {
      length_squared[c] = f[c] * f[c] + f[3 + c] * f[3 + c] + f[6 + c] * f[6 + c];
      take_higher(length_squared[c], Wide{} + kTiny);
    }
    Wide inverse_length[3];
    for (int c = 0; c < 3; ++c) {
      inverse_length[c] = reciprocal_square_root(length_squared[c]);
      for (int r = 0; r < 3; ++r) unit[3 * r + c] = f[3 * r + c] * inverse_length[c];
    }
    Wide cofactor[9];
    for (int c = 0; c < 3; ++c) {
      const int d = (c + 1) % 3, e = (c + 2) % 3;
      for (int r = 0; r < 3; ++r) {
        const int p = (r + 1) % 3, q = (r + 2) % 3;
        cofactor[3 * r + c] = unit[3 * p + d] * unit[3 * q + e] - unit[3 * q + d] * unit[3 * p + e];
      }
    }
    const Wide s = unit[0] * cofactor[0] + unit[3] * cofactor[3] + unit[6] * cofactor[6];
    below = threshold - s;
    take_higher(below, Wide{});
    for (int c = 0; c < 3; ++c)
      for (int r = 0; r < 3; ++r) {
        const Wide by_column = (cofactor[3 * r + c] - s * unit[3 * r + c]) * inverse_length[c];
        slope[3 * r + c] = below > 0 ? -by_column : Wide{};
      }
  }
};

}  // namespace subvol::internal
