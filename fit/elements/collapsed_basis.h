// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/elements/quadrature.h"

#include <cstddef>
#include <vector>

namespace subvol::internal {

/// Orthonormal polynomials over the canonical tetrahedron, as products of functions of one collapsed coordinate each
/// (Dubiner 1991; docs/references.md). With u = a (1 - b) (1 - c), v = b (1 - c), w = c,
///
///   psi_ijk = A_i(a) B_ij(b) C_sk(c),   s = i + j,   s + k <= degree,   mean over the cell of psi_m psi_n = delta_mn
///
///   A_i(a)  = sqrt(2i + 1) P_i(2a - 1)
///   B_ij(b) = (1 - b)^i P_j^(2i+1, 0)(2b - 1)
///   C_sk(c) = sqrt((s + 1) (2 (s + k) + 3) / 3) (1 - c)^s P_k^(2s+2, 0)(2c - 1)      P^(alpha, 0): Jacobi polynomials
///
/// The points are those of a quadrature (`make_quadrature`). They form layers of equal c, and these rows of equal b. So
/// a sum of all functions is evaluated in one direction after the other. Functions are listed with k fastest, then j,
/// then i; pairs (i, j) and (s, k) likewise.
struct CollapsedBasis {
  struct Row {
    int num_points;
    std::size_t a, b;  ///< where the values of A at its first point, and those of B, begin
  };
  struct Layer {
    std::size_t c;  ///< where the values of C begin
    std::vector<Row> rows;
  };
  int degree = -1;              ///< -1: there are no points
  std::vector<double> a, b, c;  ///< values of all A_i, B_ij and C_sk at a point, then at the next
  std::vector<Layer> layers;

  CollapsedBasis() = default;
  /// highest: the degree. InputError: highest < 0 or n < 2.
  CollapsedBasis(int highest, QuadratureRule rule, int n);

  int num_lines() const { return degree + 1; }
  int num_pairs() const { return (degree + 1) * (degree + 2) / 2; }
  std::size_t num_functions() const { return static_cast<std::size_t>(num_pairs()) * (degree + 3) / 3; }
  /// Number of the first pair whose first index is i.
  int first_pair(int i) const { return i * (degree + 1) - i * (i - 1) / 2; }
  /// Values of all functions at a point of a row.
  std::vector<double> values(const Layer& layer, const Row& row, int point) const;

 private:
  void add_point(double x);
};

}  // namespace subvol::internal
