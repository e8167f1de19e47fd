// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"
#include "subvol/fit/elements/element_rule.h"
#include "subvol/fit/simd/wide.h"

#include <cstddef>

namespace subvol::internal {

/// Scaled Jacobians det(d_1, d_2, d_3) / (|d_1| |d_2| |d_3|) of linear cells at the points of a rule, eight points at
/// once. d_k: columns of the Jacobian in the coordinates of the ideal cell (`ElementRule`).
class PointJacobians {
 public:
  /// Largest number of values, with those that fill the last eight.
  static constexpr std::size_t kMostPointJacobians = 128;

  PointJacobians() = default;
  /// The rule has at most `kMostPointJacobians` points.
  explicit PointJacobians(const ElementRule& rule);

  /// Writes the values at all points to `values`, and repeats the last one until their number is a multiple of eight.
  ///
  /// corners  of the cell.  least_length  at least 1e-150; shorter d_k count as if they were so long.
  void evaluate(const Vec3* corners, double least_length, double* values) const;

  /// Returns the least value.
  double least(const Vec3* corners, double least_length) const;

 private:
  std::size_t num_corners_ = 0, num_groups_ = 0;
  AlignedDoubles gradients_;  ///< of the shape functions, by eight points, direction and corner; then by point
};

}  // namespace subvol::internal
