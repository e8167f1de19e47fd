// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/shape_functions.h"

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
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
  int find(const Exponents& exponents) const { return numbers_[address(exponents)]; }

  /// Exponents as one number, such that addresses add up as exponents do: find(a + b) is at(address(a) + address(b)).
  int address(const Exponents& e) const { return (e[3] * (degree_ + 1) + e[2]) * (degree_ + 1) + e[1]; }
  int at(int address) const { return numbers_[address]; }

 private:
  int dimension_, degree_;
  std::vector<Exponents> exponents_;
  std::vector<int> numbers_;
};

/// Polynomial models of what prism functions are on their triangle, and of tet functions, over parts of the simplex.
///
///   E_edge,i V_vertex,j V_3,k = sum_alpha b_alpha B_alpha + error             B_alpha: Bernstein polynomials of the part
///
/// with Chebyshev expansions in place of the `mode_kernels` over the intervals that their arguments take on the part.
/// Legendre: exact over the whole simplex, degree `order`, and no other part has models. Fourier: of a fixed degree, so
/// that errors fall with a power of the part's size; bounds of those of value and gradient (by canonical coordinates,
/// each component) come with them. Coefficients are good to 64 units of roundoff of the largest.
///
/// Parts come about by halving: they are numbered from 1, the whole, and the halves of n are 2n and 2n + 1. There are
/// models after every `halvings_between` halvings, `most_halvings` at most.
class SimplexModels {
 public:
  struct Function {
    double value_bound, gradient_bound;  ///< of the function itself
    double error, gradient_error;
    double largest_coefficient;
    std::vector<double> coefficients;    ///< index().size() of them
  };
  using Part = std::vector<Function>;    ///< by `slot`

  /// kind: prism (its triangle) or tet. Shared by all threads, made when first asked for.
  static const SimplexModels& get(CellKind kind, Basis basis, int order);

  const SimplexIndex& index() const { return index_; }
  /// The functions' place in a part. mode.k of a prism is not looked at.
  std::size_t slot(LocalMode mode) const;

  int halvings_between() const { return index_.dimension(); }
  int most_halvings() const { return most_halvings_; }
  /// Models over part `number`, at a multiple of `halvings_between` halvings. Kept once made, while there is room, for
  /// all threads (fourier tets of order 4: 10 ms, 8: 0.2 s; prisms 1 and 30 ms).
  /// vertices: of the part, canonical; always the same for one number.
  std::shared_ptr<const Part> part(std::uint32_t number, std::span<const Vec3> vertices) const;

 private:
  SimplexModels(CellKind kind, Basis basis, int order);
  Part make_part(std::span<const Vec3> vertices) const;

  CellKind kind_;
  Basis basis_;
  SimplexIndex index_;
  int most_halvings_;
  std::vector<LocalMode> modes_;  // by slot
  std::map<LocalMode, std::size_t> slots_;
  mutable std::mutex mutex_;
  mutable std::map<std::uint32_t, std::shared_ptr<const Part>> stored_;  // by number
};

}  // namespace subvol
