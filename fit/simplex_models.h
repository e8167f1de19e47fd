// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/shape_functions.h"

#include <map>
#include <memory>
#include <span>
#include <vector>

namespace subvol {

/// Exponents of the Bernstein polynomials of one degree over a triangle (3 barycentric coordinates) or tetrahedron (4):
/// alpha_0 + .. + alpha_d = degree, all of them, alpha_d slowest.
class SimplexIndex {
 public:
  using Exponents = std::array<std::int8_t, 4>;

  SimplexIndex(int dimension, int degree);
  int dimension() const { return dimension_; }
  int degree() const { return degree_; }
  int size() const { return static_cast<int>(exponents_.size()); }
  const Exponents& exponents(int n) const { return exponents_[n]; }
  int find(const Exponents& exponents) const;

 private:
  int dimension_, degree_;
  std::vector<Exponents> exponents_;
  std::vector<int> numbers_;
};

/// Polynomial models, over the whole simplex, of what prism functions are on their triangle, and of tet functions.
///
///   E_edge,i V_vertex,j V_3,k = sum_alpha b_alpha B_alpha + error
///
/// with Chebyshev expansions in place of the `mode_kernels`. Legendre: exact, degree `order`. Fourier: of a degree that
/// leaves little to the first modes; bounds of the errors of value and gradient (by canonical coordinates, each
/// component) come with them. Coefficients are good to 64 units of roundoff of the largest.
class SimplexModels {
 public:
  struct Function {
    double value_bound, gradient_bound;  ///< of the function itself
    double error, gradient_error;
    double largest_coefficient;
    std::vector<double> coefficients;    ///< index().size() of them
  };

  /// kind: prism (its triangle) or tet. Shared by all threads, made when first asked for (milliseconds).
  static const SimplexModels& get(CellKind kind, Basis basis, int order);

  const SimplexIndex& index() const { return index_; }
  /// mode.k of a prism is not looked at.
  const Function& function(LocalMode mode) const;

 private:
  SimplexModels(CellKind kind, Basis basis, int order);

  CellKind kind_;
  SimplexIndex index_;
  std::map<LocalMode, Function> functions_;
};

}  // namespace subvol
