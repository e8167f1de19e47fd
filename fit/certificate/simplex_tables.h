// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/certificate/simplex_polynomials.h"

#include <mutex>

namespace subvol::internal {

/// Returns the least multiple of `unit` that is n or more.
inline std::size_t rounded_up(std::size_t n, std::size_t unit) { return (n + unit - 1) / unit * unit; }

/// Neighbors among the Bernstein coefficients of one degree over a triangle or tetrahedron.
class SimplexTables {
 public:
  static constexpr int kMostTableDegree = 24;
  static constexpr std::size_t kControlPointLanes = 4;  ///< control points are processed this many numbers at a time

  /// dimension: 2 or 3; degree: 1 .. kMostTableDegree. Shared by all threads and made when first requested.
  static const SimplexTables& get(int dimension, int degree);

  SimplexIndex index, lower;  ///< of the degree, and of one less
  std::size_t stride;         ///< a multiple of kWide, at least index.size()
  /// Per index of `lower`: with one exponent more; padded to kControlPointLanes.
  std::array<std::vector<int>, 4> raised;

  /// Bisection of the side from vertex a to b > a. Made when first requested.
  const SimplexHalving& halving(int a, int b) const;

 private:
  SimplexTables(int dimension, int degree);

  mutable std::array<std::array<SimplexHalving, 4>, 4> halvings_;
  mutable std::array<std::array<std::once_flag, 4>, 4> halved_;
};

}  // namespace subvol::internal
