// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace subvol::internal {

/// Exponents of the Bernstein polynomials of one degree over a triangle (3 barycentric coordinates) or tetrahedron (4):
/// all alpha with alpha_0 + .. + alpha_d = degree; alpha_1 varies fastest, alpha_d slowest.
class SimplexIndex {
 public:
  using Exponents = std::array<std::int8_t, 4>;

  SimplexIndex(int dimension, int degree);
  int dimension() const { return dimension_; }
  int degree() const { return degree_; }
  int size() const { return static_cast<int>(exponents_.size()); }
  const Exponents& exponents(int n) const { return exponents_[n]; }
  int find(const Exponents& e) const { return numbers_[(e[3] * (degree_ + 1) + e[2]) * (degree_ + 1) + e[1]]; }

 private:
  int dimension_, degree_;
  std::vector<Exponents> exponents_;
  std::vector<int> numbers_;
};

/// De Casteljau's rounds that turn the control points of a polynomial into those of its halves: the side from vertex a
/// to b is bisected. Means c_n <- (c_n + c_m) / 2 leave those of the half at a in place; after each round, copies from
/// n to m collect those of the half at b.
struct SimplexHalving {
  using Pair = std::array<std::uint16_t, 2>;  ///< n, m
  struct Round {
    std::vector<Pair> means, copies;
  };
  std::vector<Round> rounds;

  SimplexHalving() = default;
  SimplexHalving(const SimplexIndex& index, int a, int b);
};

/// A polynomial over a triangle or tetrahedron with barycentric coordinates l, and a bound on its rounding errors.
///
///   p = sum_{|alpha| = degree} c_alpha l^alpha = sum_alpha b_alpha B_alpha,    c_alpha = b_alpha degree! / alpha!
class SimplexPolynomial {
 public:
  /// A constant. dimension: 2 or 3.
  SimplexPolynomial(int dimension, double value);

  /// p times the affine function with these values at the vertices: each at most 1 in size, accurate to 4 units of
  /// roundoff.
  SimplexPolynomial times_affine(const std::array<double, 4>& values) const;
  /// The same polynomial, written with degree + 1.
  SimplexPolynomial raised() const { return times_affine({1, 1, 1, 1}); }
  /// weight_a a + weight_b b, of the same degree.
  static SimplexPolynomial combined(double weight_a, const SimplexPolynomial& a, double weight_b,
                                    const SimplexPolynomial& b);
  /// sum_{k <= n} weights_k a_k b_{n-k}, where all a_k and b_k have degree k. Weights beyond the end are 0; the others
  /// are accurate to one unit of roundoff. n must be less than the number of a_k and of b_k.
  static SimplexPolynomial convolved(std::span<const double> weights, std::span<const SimplexPolynomial> a,
                                     std::span<const SimplexPolynomial> b, int n);

  int degree() const { return degree_; }
  /// Writes b_alpha in the order of a `SimplexIndex`, and as many entries as it has.
  void bernstein(double* coefficients) const;
  /// Bounds on |b_alpha|, and so on |p|; on the errors of the b_alpha, including those of `bernstein`.
  double bound() const { return bound_; }
  double rounding() const { return rounding_ + 32 * kDoubleRoundoff * bound_; }

  static constexpr double kDoubleRoundoff = std::numeric_limits<double>::epsilon() / 2;

 private:
  SimplexPolynomial() = default;
  static SimplexPolynomial zero(int dimension, int degree);
  int last_layer() const { return dimension_ == 3 ? degree_ : 0; }
  std::size_t row(int e2, int e3) const {
    return static_cast<std::size_t>((e3 * (2 * degree_ + 3 - e3) / 2 + e2) * stride_);
  }
  double at(int e1, int e2, int e3) const { return terms_[row(e2, e3) + e1]; }
  void add_shifted(double weight, const SimplexPolynomial& q, int e1, int e2, int e3);
  void find_bound();

  int dimension_ = 0, degree_ = 0, stride_ = 0;
  double bound_ = 0, rounding_ = 0;
  std::vector<double> terms_;  ///< c_alpha at row(alpha_2, alpha_3) + alpha_1; rows are padded with zeros
};

}  // namespace subvol::internal
