// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/certificate/line_models.h"

#include "subvol/fit/certificate/chebyshev.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <memory>
#include <span>

namespace subvol::internal {

namespace {

/// P_0 .. P_count at t.
std::array<long double, kMaxOrder + 2> legendre(int count, long double t) {
  std::array<long double, kMaxOrder + 2> p{1, t};
  for (int i = 1; i < count; ++i) p[i + 1] = ((2 * i + 1) * t * p[i] - i * p[i - 1]) / (i + 1);
  return p;
}

long double mode_value(Basis basis, int i, long double x) {
  constexpr long double pi = std::numbers::pi_v<long double>, sqrt2 = std::numbers::sqrt2_v<long double>;
  if (basis == Basis::fourier) return sqrt2 * std::sin(i * pi * x) / (i * pi);
  const auto p = legendre(i + 1, 1 - 2 * x);
  return (p[i - 1] - p[i + 1]) / (2 * std::sqrt(2 * i + 1.0L));
}

long double mode_slope(Basis basis, int i, long double x) {
  constexpr long double pi = std::numbers::pi_v<long double>, sqrt2 = std::numbers::sqrt2_v<long double>;
  if (basis == Basis::fourier) return sqrt2 * std::cos(i * pi * x);
  return std::sqrt(2 * i + 1.0L) * legendre(i, 1 - 2 * x)[i];
}

/// Logarithm of a bound on the k-th derivative of phi_i'; Legendre requires k > i, so that it is zero.
double log_slope_derivative(Basis basis, int i, int k) {
  if (basis == Basis::legendre) return -std::numeric_limits<double>::infinity();
  return 0.5 * std::numbers::ln2 + k * std::log(i * std::numbers::pi);
}

/// Returns a close upper bound of |phi_i|: between neighboring samples a function exceeds the larger one by at most
/// (distance^2 / 8) max |phi_i''|, and |P_i'| <= i (i + 1) / 2.
double largest_integrated_legendre(int i) {
  constexpr int kLegendreSamples = 2000;  // the bound then exceeds the maximum by less than 1e-4
  long double largest = 0;
  for (int k = 1; k < kLegendreSamples; ++k)
    largest =
        std::max(largest, std::abs(mode_value(Basis::legendre, i, static_cast<long double>(k) / kLegendreSamples)));
  return static_cast<double>(largest) +
         std::sqrt(2 * i + 1.0) * i * (i + 1) / (8.0 * kLegendreSamples * kLegendreSamples);
}

/// Returns the value at 1/2 of a polynomial with these Bernstein coefficients.
long double value_in_middle(std::span<const long double> coefficients) {
  const int degree = static_cast<int>(coefficients.size()) - 1;
  long double value = 0, binomial = 1;
  for (int o = 0; o <= degree; ++o) {
    value += std::ldexp(binomial * coefficients[o], -degree);
    binomial = binomial * (degree - o) / (o + 1);
  }
  return value;
}

}  // namespace

const LineModels& LineModels::get(Basis basis, int order, int degree) {
  assert(order >= 1 && order <= kMaxOrder && degree >= 1 && degree <= kMostModelDegree);
  struct Made {
    std::unique_ptr<const LineModels> models;
    std::once_flag once;
  };
  static std::array<std::array<std::array<Made, kMostModelDegree + 1>, kMaxOrder + 1>, 2> all;
  Made& made = all[static_cast<std::size_t>(basis)][order][degree];
  std::call_once(made.once, [&] { made.models.reset(new LineModels(basis, order, degree)); });
  return *made.models;
}

LineModels::LineModels(Basis basis, int order, int degree) : basis_(basis), order_(order), degree_(degree) {
  bounds_[0] = bounds_[1] = slope_bounds_[0] = slope_bounds_[1] = 1;
  constexpr double kRoundingUp = 1 + 1e-14;  // more than the rounding of the bounds
  for (int i = 1; i < order; ++i) {
    const bool fourier = basis == Basis::fourier;
    bounds_[i + 1] =
        kRoundingUp * (fourier ? std::numbers::sqrt2 / (i * std::numbers::pi) : largest_integrated_legendre(i));
    slope_bounds_[i + 1] = kRoundingUp * (fourier ? std::numbers::sqrt2 : std::sqrt(2 * i + 1.0));
  }
}

const LineModels::Level& LineModels::level(int l) const {
  assert(l >= 0 && l <= kMaxLevel);
  std::call_once(made_[l], [&] { levels_[l] = make_level(l); });
  return levels_[l];
}

LineModels::Level LineModels::make_level(int l) const {
  Level level;
  level.coefficients.assign((std::size_t{1} << l) * (order_ + 1) * kStride, 0);
  model_corner_functions(l, level);
  model_modes(l, level);
  fill_single_precision(level);
  return level;
}

/// Fills the coefficients of N_0 and N_1.
void LineModels::model_corner_functions(int l, Level& level) const {
  const int q = degree_, parts = 1 << l;
  const long double size = std::ldexp(1.0L, -l);
  for (int part = 0; part < parts; ++part)
    for (int o = 0; o <= q; ++o) {
      const long double x = (part + static_cast<long double>(o) / q) * size;
      coefficients(level, part, 0)[o] = static_cast<double>(1 - x);
      coefficients(level, part, 1)[o] = static_cast<double>(x);
    }
}

/// Fills the coefficients of the other functions, and bounds all errors.
void LineModels::model_modes(int l, Level& level) const {
  const int q = degree_, parts = 1 << l;
  const long double size = std::ldexp(1.0L, -l);
  // Radius times frequency decides how many nodes make the interpolant exact for all purposes.
  const double widest = order_ * std::numbers::pi * static_cast<double>(size) / 2;
  const int num_nodes = basis_ == Basis::legendre ? std::max(order_, q) : q + 10 + static_cast<int>(2.2 * widest);
  const ChebyshevExpansion expansion(num_nodes);
  const auto to_bernstein = chebyshev_to_bernstein(q - 1);
  std::vector<long double> expanded(q), slope(q), value(q + 1);
  for (int i = 1; i < order_; ++i) {
    for (int part = 0; part < parts; ++part) {
      Errors& errors = level.errors[zone(l, part)];
      double& error = errors.value[i + 1];
      double& slope_error = errors.slope[i + 1];
      const long double mid = (part + 0.5L) * size;
      double remainder = expansion.expand([&](long double x) { return mode_slope(basis_, i, x); }, mid, size / 2,
                                          log_slope_derivative(basis_, i, num_nodes), q, expanded.data());
      if (basis_ == Basis::legendre && i < q) remainder = 0;
      const bool constant = remainder >= slope_bounds_[i + 1];  // a zero slope is no worse than that model
      if (constant) remainder = slope_bounds_[i + 1];
      slope_error = std::max(slope_error, remainder);
      level.exact = level.exact && remainder == 0;
      error = std::max(error, constant ? std::min(remainder * static_cast<double>(size) / 2, 2 * bounds_[i + 1])
                                       : remainder * static_cast<double>(size) / 2);

      std::fill(slope.begin(), slope.end(), 0.0L);
      for (int k = 0; !constant && k < q; ++k)
        for (int o = 0; o < q; ++o) slope[o] += expanded[k] * to_bernstein[k][o];
      value[0] = 0;
      for (int o = 0; o < q; ++o) value[o + 1] = value[o] + slope[o] * size / q;
      const long double shift = mode_value(basis_, i, mid) - value_in_middle(value);
      for (int o = 0; o <= q; ++o) coefficients(level, part, i + 1)[o] = static_cast<double>(value[o] + shift);
    }
  }
}

/// Fills what `Level` holds for single precision, and the largest coefficients.
void LineModels::fill_single_precision(Level& level) const {
  const int q = degree_;
  level.narrow_coefficients.resize(level.coefficients.size());
  std::transform(level.coefficients.begin(), level.coefficients.end(), level.narrow_coefficients.begin(),
                 [](double b) { return static_cast<float>(b); });
  level.deviations.assign(level.coefficients.size(), 0);
  for (std::size_t at = 0; at < level.coefficients.size(); at += kStride) {
    const std::size_t i = at / kStride % (order_ + 1);
    const double* b = level.coefficients.data() + at;
    float* deviations = level.deviations.data() + at;
    const auto [least, largest] = std::minmax_element(b, b + q + 1);
    const double middle = 0.5 * (*least + *largest), bound = std::max(-*least, *largest);
    level.largest_coefficient[i] = std::max(level.largest_coefficient[i], bound);
    for (int o = 0; o <= q; ++o) deviations[o] = static_cast<float>(b[o] - middle);
    float* then = deviations + q + 1;
    then[kMiddle] = static_cast<float>(middle);
    then[kLargestDeviation] = static_cast<float>(*largest - middle);
    then[kMiddleSize] = std::abs(then[kMiddle]);
    then[kLargest] = static_cast<float>(bound);
  }
}

}  // namespace subvol::internal
