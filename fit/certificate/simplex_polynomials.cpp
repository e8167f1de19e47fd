// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/certificate/simplex_polynomials.h"

#include "subvol/fit/simd/wide.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace subvol::internal {

namespace {

const std::array<double, 64>& factorials() {
  static const std::array<double, 64> table = [] {
    std::array<double, 64> result{1};
    for (std::size_t n = 1; n < result.size(); ++n) result[n] = result[n - 1] * static_cast<double>(n);
    return result;
  }();
  return table;
}

/// Calls f(e1, e2, e3, alpha! / degree!) for all exponents, in the order of a SimplexIndex.
template <class Function>
void for_each_term(int dimension, int degree, const Function& f) {
  const auto& factorial = factorials();
  for (int e3 = 0; e3 <= (dimension == 3 ? degree : 0); ++e3)
    for (int e2 = 0; e2 + e3 <= degree; ++e2) {
      const double row = factorial[e3] * factorial[e2] / factorial[degree];
      const int last = degree - e2 - e3;
      for (int e1 = 0; e1 <= last; ++e1) f(e1, e2, e3, row * factorial[e1] * factorial[last - e1]);
    }
}

}  // namespace

SimplexIndex::SimplexIndex(int dimension, int degree)
    : dimension_(dimension), degree_(degree), numbers_((degree + 1) * (degree + 1) * (degree + 1), -1) {
  for_each_term(dimension, degree, [&](int e1, int e2, int e3, double) {
    const auto narrow = [](int e) { return static_cast<std::int8_t>(e); };
    exponents_.push_back({narrow(degree - e1 - e2 - e3), narrow(e1), narrow(e2), narrow(e3)});
    numbers_[(e3 * (degree + 1) + e2) * (degree + 1) + e1] = size() - 1;
  });
}

SimplexHalving::SimplexHalving(const SimplexIndex& index, int a, int b) {
  const auto number = [&](SimplexIndex::Exponents e, int to_a) {
    e[a] = static_cast<std::int8_t>(e[a] + to_a);
    e[b] = static_cast<std::int8_t>(e[b] - to_a);
    return static_cast<std::uint16_t>(index.find(e));
  };
  // The means of one round depend on each other: those with the highest exponents of b come first.
  for (int done = 0; done <= index.degree(); ++done) {
    Round& round = rounds.emplace_back();
    for (int exponent = index.degree(); exponent >= std::max(done, 1); --exponent)
      for (int n = 0; n < index.size(); ++n) {
        const SimplexIndex::Exponents& e = index.exponents(n);
        if (e[b] != exponent) continue;
        const auto at = static_cast<std::uint16_t>(n);
        if (done > 0) round.means.push_back({at, number(e, 1)});
        if (e[a] == 0) round.copies.push_back({at, number(e, done)});
      }
  }
}

SimplexPolynomial SimplexPolynomial::zero(int dimension, int degree) {
  SimplexPolynomial p;
  p.dimension_ = dimension;
  p.degree_ = degree;
  p.stride_ = (degree + kWide) / kWide * kWide;
  const int rows = dimension == 3 ? (degree + 1) * (degree + 2) / 2 : degree + 1;
  p.terms_.assign(static_cast<std::size_t>(rows) * p.stride_ + kWide, 0.0);
  return p;
}

SimplexPolynomial::SimplexPolynomial(int dimension, double value) : SimplexPolynomial(zero(dimension, 0)) {
  terms_[0] = value;
  bound_ = std::abs(value);
}

void SimplexPolynomial::find_bound() {
  double largest = 0;
  for_each_term(dimension_, degree_, [&](int e1, int e2, int e3, double share) {
    largest = std::max(largest, std::abs(at(e1, e2, e3)) * share);
  });
  bound_ = largest * (1 + 1e-14) + rounding_;
}

SimplexPolynomial SimplexPolynomial::times_affine(const std::array<double, 4>& values) const {
  SimplexPolynomial result = zero(dimension_, degree_ + 1);
  const auto add = [&](int e2, int e3, int length, std::size_t at, double value) {
    const double* in = terms_.data() + row(e2, e3);
    double* out = result.terms_.data() + at;
    for (int e1 = 0; e1 < length; ++e1) out[e1] += value * in[e1];
  };
  for (int e3 = 0; e3 <= last_layer(); ++e3)
    for (int e2 = 0; e2 + e3 <= degree_; ++e2) {
      const int length = degree_ - e2 - e3 + 1;
      add(e2, e3, length, result.row(e2, e3), values[0]);
      add(e2, e3, length, result.row(e2, e3) + 1, values[1]);
      add(e2, e3, length, result.row(e2 + 1, e3), values[2]);
      if (dimension_ == 3) add(e2, e3, length, result.row(e2, e3 + 1), values[3]);
    }
  // Each b_alpha is a mean of four values times b's: with an error of 4 units in the value, a product, three sums.
  result.rounding_ = 1.0001 * (rounding_ + 9 * kDoubleRoundoff * bound_);
  result.find_bound();
  return result;
}

SimplexPolynomial SimplexPolynomial::combined(double weight_a, const SimplexPolynomial& a, double weight_b,
                                              const SimplexPolynomial& b) {
  assert(a.degree_ == b.degree_);
  SimplexPolynomial result = zero(a.dimension_, a.degree_);
  for (std::size_t m = 0; m < a.terms_.size(); ++m) result.terms_[m] = weight_a * a.terms_[m] + weight_b * b.terms_[m];
  const double size_a = std::abs(weight_a), size_b = std::abs(weight_b);
  result.rounding_ = 1.0001 * (size_a * (a.rounding_ + 2 * kDoubleRoundoff * a.bound_) +
                               size_b * (b.rounding_ + 2 * kDoubleRoundoff * b.bound_));
  result.find_bound();
  return result;
}

SimplexPolynomial SimplexPolynomial::convolved(std::span<const double> weights, std::span<const SimplexPolynomial> a,
                                               std::span<const SimplexPolynomial> b, int n) {
  const int dimension = a[0].dimension_, last = std::min(n, static_cast<int>(weights.size()) - 1);
  SimplexPolynomial result = zero(dimension, n);
  double sizes = 0;
  for (int k = 0; k <= last; ++k) {
    // The factor of lower degree is taken term by term, the other one by rows.
    const bool swap = k > n - k;
    const SimplexPolynomial &p = swap ? b[n - k] : a[k], &q = swap ? a[k] : b[n - k];
    const double size = std::abs(weights[k]);
    sizes += size * p.bound_ * q.bound_;
    result.rounding_ += size * (p.rounding_ * q.bound_ + p.bound_ * q.rounding_);
    for (int e3 = 0; e3 <= p.last_layer(); ++e3)
      for (int e2 = 0; e2 + e3 <= p.degree_; ++e2)
        for (int e1 = 0; e1 + e2 + e3 <= p.degree_; ++e1)
          result.add_shifted(weights[k] * p.at(e1, e2, e3), q, e1, e2, e3);
  }
  // Each b_alpha is a sum of means of products; alpha is a sum of two exponents in at most num_terms ways.
  const double num_terms = std::pow(1 + n / (dimension + 1.0), dimension + 1);
  result.rounding_ = 1.0001 * (result.rounding_ + (num_terms + 5) * kDoubleRoundoff * sizes);
  result.find_bound();
  return result;
}

/// Adds weight l^e q.
void SimplexPolynomial::add_shifted(double weight, const SimplexPolynomial& q, int e1, int e2, int e3) {
  if (weight == 0) return;
  for (int f3 = 0; f3 <= q.last_layer(); ++f3) {
    const double* in = q.terms_.data() + q.row(0, f3);
    double* out = terms_.data() + row(e2, e3 + f3) + e1;
    for (int last = q.degree_ - f3; last >= 0; --last, in += q.stride_, out += stride_)
      for (int m = 0; m <= last; m += kWide)  // the padding of a row adds zeros to the next one
        store_wide(load_wide(out + m) + weight * load_wide(in + m), out + m);
  }
}

void SimplexPolynomial::bernstein(double* coefficients) const {
  for_each_term(dimension_, degree_,
                [&](int e1, int e2, int e3, double share) { *coefficients++ = at(e1, e2, e3) * share; });
}

}  // namespace subvol::internal
