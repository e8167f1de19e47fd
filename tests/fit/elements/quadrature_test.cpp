// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/elements/quadrature.h"
#include "subvol/base/error.h"
#include "tests/support/element_fixtures.h"

#include <catch2/catch.hpp>

#include <cmath>

using namespace subvol;
using namespace subvol::internal;
using namespace subvol::test;

namespace {

double factorial(int n) { return n < 2 ? 1 : n * factorial(n - 1); }

/// Mean of u^a v^b w^c over a canonical cell.
double exact_mean(CellKind kind, int a, int b, int c) {
  if (kind == CellKind::hex) return 1.0 / ((a + 1) * (b + 1) * (c + 1));
  if (kind == CellKind::tet) return 6 * factorial(a) * factorial(b) * factorial(c) / factorial(a + b + c + 3);
  return 2 * factorial(a) * factorial(b) / factorial(a + b + 2) / (c + 1);
}

double mean(const Quadrature& rule, int a, int b, int c) {
  double sum = 0;
  for (std::size_t q = 0; q < rule.points.size(); ++q)
    sum += rule.weights[q] * std::pow(rule.points[q][0], a) * std::pow(rule.points[q][1], b) *
           std::pow(rule.points[q][2], c);
  return sum;
}

}  // namespace

TEST_CASE("weights are positive, sum to one, and rules are exact up to their degree", "[quadrature]") {
  for (const CellKind kind : kAllKinds)
    for (const QuadratureRule name : {QuadratureRule::trapezoidal, QuadratureRule::gauss_lobatto})
      for (const int n : {2, 3, 4, 7, 12}) {
        const Quadrature rule = make_quadrature(kind, name, n);
        CHECK(mean(rule, 0, 0, 0) == Approx(1).epsilon(1e-13));
        for (const double weight : rule.weights) CHECK(weight > 0);
        const int degree = name == QuadratureRule::trapezoidal ? 1 : 2 * n - 3;
        for (int a = 0; a <= degree; ++a)
          for (int b = 0; a + b <= degree; ++b)
            for (int c = 0; a + b + c <= degree; ++c)
              CHECK(mean(rule, a, b, c) == Approx(exact_mean(kind, a, b, c)).epsilon(1e-12));
      }
  CHECK(make_quadrature(CellKind::tet, QuadratureRule::trapezoidal, 4).points.size() == 20);
  CHECK(make_quadrature(CellKind::prism, QuadratureRule::trapezoidal, 4).points.size() == 40);
  CHECK(make_quadrature(CellKind::hex, QuadratureRule::trapezoidal, 4).points.size() == 64);
}

TEST_CASE("trapezoidal rules converge with the square of their step on triangle and tet", "[quadrature]") {
  for (const CellKind kind : {CellKind::prism, CellKind::tet}) {
    const double exact = exact_mean(kind, 2, 0, 0);
    const double coarse = std::abs(mean(make_quadrature(kind, QuadratureRule::trapezoidal, 9), 2, 0, 0) - exact);
    const double fine = std::abs(mean(make_quadrature(kind, QuadratureRule::trapezoidal, 17), 2, 0, 0) - exact);
    CHECK(std::log2(coarse / fine) == Approx(2).margin(0.1));
  }
}

TEST_CASE("line rules have their closed forms; counts for orders nest", "[quadrature]") {
  CHECK(gauss_rule(1).points[0] == Approx(0.5));
  CHECK(gauss_rule(2).points[0] == Approx(0.5 - std::sqrt(3.0) / 6));
  CHECK(gauss_lobatto_rule(3).weights[1] == Approx(2.0 / 3));
  CHECK(gauss_lobatto_rule(4).points[1] == Approx(0.5 - std::sqrt(5.0) / 10));
  CHECK(points_for_order(1) == 2);
  CHECK(points_for_order(4) == 7);
  int last = 2;
  for (int order = 1; order <= kMaxOrder; ++order) {
    const int n = nested_points_for_order(order);
    CHECK(n >= points_for_order(order));
    CHECK((n - 1) % (last - 1) == 0);
    last = n;
  }
}

TEST_CASE("rules of too few points are refused", "[quadrature]") {
  CHECK_THROWS_AS(make_quadrature(CellKind::hex, QuadratureRule::trapezoidal, 1), InputError);
  CHECK_THROWS_AS(make_triangle_quadrature(QuadratureRule::trapezoidal, 1), InputError);
  CHECK_THROWS_AS(gauss_rule(0), InputError);
  CHECK_THROWS_AS(gauss_lobatto_rule(1), InputError);
  CHECK_THROWS_AS(trapezoidal_rule(1), InputError);
}
