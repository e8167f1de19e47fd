// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/certificate/line_models.h"

#include <catch2/catch.hpp>

#include <cmath>

using namespace subvol;
using namespace subvol::internal;

namespace {

constexpr double kRounding = 1e-12;

/// sum_o b_o B_o(t) by de Casteljau, and its derivative by t.
double bernstein_sum(const double* b, int degree, double t, double& slope) {
  std::array<double, LineModels::kMostModelDegree + 1> x{};
  std::copy_n(b, degree + 1, x.begin());
  slope = 0;
  for (int n = degree; n > 0; --n) {
    if (n == 1) slope = degree * (x[1] - x[0]);
    for (int o = 0; o < n; ++o) x[o] += t * (x[o + 1] - x[o]);
  }
  return x[0];
}

}  // namespace

TEST_CASE("Models of functions along a line are as close to them as they say", "[certificate][slow]") {
  const Basis basis = GENERATE(Basis::fourier, Basis::legendre);
  const int order = GENERATE(1, 2, 4, 8, 12, kMaxOrder), degree = GENERATE(1, 3, 5, 7, 8);
  CAPTURE(order, degree);
  const LineModels& models = LineModels::get(basis, order, degree);
  std::array<double, kMaxOrder + 1> exact{}, exact_slopes{};
  double worst = 0, above_bounds = 0;
  for (int l = 0; l <= 5; ++l) {
    const LineModels::Level& level = models.level(l);
    for (int part = 0; part < 1 << l; ++part) {
      const LineModels::Errors& errors = level.errors[LineModels::zone(l, part)];
      const double* table = models.coefficients(level, part);
      for (int s = 0; s <= 40; ++s) {
        const double t = s / 40.0;
        line_functions(basis, order, std::ldexp(part + t, -l), exact.data(), exact_slopes.data());
        for (int i = 0; i <= order; ++i) {
          const double* b = table + i * LineModels::kStride;
          double slope;
          const double value = bernstein_sum(b, degree, t, slope);
          worst = std::max({worst, std::abs(value - exact[i]) - errors.value[i],
                            std::abs(std::ldexp(slope, l) - exact_slopes[i]) - errors.slope[i]});
          above_bounds = std::max({above_bounds, std::abs(exact[i]) - models.bounds()[i],
                                   std::abs(exact_slopes[i]) - models.slope_bounds()[i]});
          for (int o = 0; o <= degree; ++o) CHECK(std::abs(b[o]) <= level.largest_coefficient[i]);
        }
      }
    }
  }
  CHECK(worst < kRounding);
  CHECK(above_bounds < kRounding);
}

TEST_CASE("Parts in the middle have closer models of Legendre polynomials than those at the ends", "[certificate]") {
  const LineModels::Level& level = LineModels::get(Basis::legendre, 12, 7).level(3);
  for (int i = 9; i <= 12; ++i)  // the 8th one has the same error everywhere
    for (int zone = 1; zone < LineModels::kZones; ++zone)
      CHECK(level.errors[zone].slope[i] < 0.8 * level.errors[0].slope[i]);
}
