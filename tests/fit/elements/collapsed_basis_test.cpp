// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/elements/collapsed_basis.h"
#include "subvol/base/error.h"

#include <catch2/catch.hpp>

using namespace subvol;
using namespace subvol::internal;

namespace {

/// Values of all functions at all points, in the order of the quadrature's points.
std::vector<std::vector<double>> all_values(const CollapsedBasis& basis) {
  std::vector<std::vector<double>> result;
  for (const CollapsedBasis::Layer& layer : basis.layers)
    for (const CollapsedBasis::Row& row : layer.rows)
      for (int point = 0; point < row.num_points; ++point) result.push_back(basis.values(layer, row, point));
  return result;
}

}  // namespace

TEST_CASE("collapsed functions are orthonormal over the tetrahedron", "[quadrature]") {
  for (const int degree : {0, 1, 4, 9}) {
    const int n = degree + 2;  // exact up to degree 2 degree + 1
    const CollapsedBasis basis(degree, QuadratureRule::gauss_lobatto, n);
    const Quadrature quadrature = make_quadrature(CellKind::tet, QuadratureRule::gauss_lobatto, n);
    const auto values = all_values(basis);
    REQUIRE(values.size() == quadrature.points.size());
    double error = 0;
    for (std::size_t a = 0; a < basis.num_functions(); ++a)
      for (std::size_t b = 0; b < basis.num_functions(); ++b) {
        double mean = 0;
        for (std::size_t q = 0; q < values.size(); ++q) mean += quadrature.weights[q] * values[q][a] * values[q][b];
        error = std::max(error, std::abs(mean - (a == b)));
      }
    CHECK(error < 1e-12);
  }
}

TEST_CASE("collapsed functions are polynomials in the points of both quadratures", "[quadrature]") {
  constexpr int kDegree = 3;
  const CollapsedBasis gauss(kDegree, QuadratureRule::gauss_lobatto, kDegree + 2);
  const Quadrature quadrature = make_quadrature(CellKind::tet, QuadratureRule::gauss_lobatto, kDegree + 2);
  const auto values = all_values(gauss);
  const auto polynomial = [](const Vec3& p) {
    return 1 + p[0] - 2 * p[1] * p[2] + 3 * p[0] * p[2] * p[2] - p[1] * p[1];
  };
  std::vector<double> coefficients(gauss.num_functions(), 0.0);
  for (std::size_t q = 0; q < values.size(); ++q)
    for (std::size_t m = 0; m < coefficients.size(); ++m)
      coefficients[m] += quadrature.weights[q] * values[q][m] * polynomial(quadrature.points[q]);
  for (const QuadratureRule rule : {QuadratureRule::gauss_lobatto, QuadratureRule::trapezoidal})
    for (const int n : {2, 3, 6}) {
      const Quadrature points = make_quadrature(CellKind::tet, rule, n);
      const auto there = all_values(CollapsedBasis(kDegree, rule, n));
      REQUIRE(there.size() == points.points.size());
      for (std::size_t q = 0; q < there.size(); ++q) {
        double sum = 0;
        for (std::size_t m = 0; m < coefficients.size(); ++m) sum += coefficients[m] * there[q][m];
        CHECK(sum == Approx(polynomial(points.points[q])).margin(1e-12));
      }
    }
}

TEST_CASE("a collapsed basis needs a degree and two points", "[quadrature]") {
  CHECK_THROWS_AS(CollapsedBasis(-1, QuadratureRule::gauss_lobatto, 3), InputError);
  CHECK_THROWS_AS(CollapsedBasis(2, QuadratureRule::trapezoidal, 1), InputError);
  CHECK_THROWS_AS(CollapsedBasis(2, QuadratureRule::gauss_lobatto, 0), InputError);
}
