// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/elements/quadrature.h"

#include "subvol/base/error.h"

#include <array>
#include <cmath>
#include <numbers>
#include <string>

namespace subvol::internal {

namespace {

void check_count(const char* what, int n, int least) {
  if (n < least)
    throw InputError(std::string(what) + ": at least " + std::to_string(least) + " points a direction, got " +
                     std::to_string(n));
}

/// P_n, P_n-1 at t.
std::array<double, 2> legendre(int n, double t) {
  double value = 1, old = 0;
  for (int i = 0; i < n; ++i) {
    const double next = ((2 * i + 1) * t * value - i * old) / (i + 1);
    old = value;
    value = next;
  }
  return {value, old};
}

/// Newton's method from x0; the functions here have simple zeros, and the initial values are good.
template <class Step>
double refine(double x, const Step& step) {
  for (int i = 0; i < 50; ++i) {
    const double change = step(x);
    x -= change;
    if (std::abs(change) < 1e-16) break;
  }
  return x;
}

/// Makes a rule on [0, 1] symmetric bit by bit, from its upper half.
void mirror(LineRule& rule) {
  const std::size_t n = rule.points.size();
  for (std::size_t i = 0; i < n / 2; ++i) {
    rule.points[i] = 1 - rule.points[n - 1 - i];
    rule.weights[i] = rule.weights[n - 1 - i];
  }
}

Quadrature regular_triangle(int n) {
  Quadrature rule;
  const double third = 1.0 / ((n - 1) * (n - 1) * 3.0);
  for (int j = 0; j < n; ++j)
    for (int i = 0; i + j < n; ++i) {
      const int zeros = (i == 0) + (j == 0) + (i + j == n - 1);
      const int triangles = zeros == 0 ? 6 : zeros == 1 ? 3 : 1;
      rule.points.push_back(Vec3(i, j, 0) / (n - 1));
      rule.weights.push_back(third * triangles);
    }
  return rule;
}

/// u = s (1 - v): the Jacobian 1 - v costs one degree, so n Gauss points are exact up to 2n - 2.
Quadrature collapsed_triangle(int n) {
  const LineRule line = gauss_rule(n);
  Quadrature rule;
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      const double side = 1 - line.points[j];
      rule.points.push_back(Vec3(line.points[i] * side, line.points[j], 0));
      rule.weights.push_back(2 * side * line.weights[i] * line.weights[j]);
    }
  return rule;
}

/// Each cube of the grid splits into an upright tet, an octahedron of four times its volume, and an inverted tet, as
/// far as these lie inside.
Quadrature regular_tet(int n) {
  const int last = n - 1;
  std::vector<double> sums(n * n * n, 0.0);  // in volumes of a small tet
  const auto add = [&](int i, int j, int k, double share) { sums[(k * n + j) * n + i] += share; };
  for (int k = 0; k < last; ++k)
    for (int j = 0; j + k < last; ++j)
      for (int i = 0; i + j + k < last; ++i)
        for (int corner = 0; corner < 8; ++corner) {
          const int a = corner & 1, b = corner >> 1 & 1, c = corner >> 2, level = a + b + c, room = last - (i + j + k);
          if (level <= 1) add(i + a, j + b, k + c, 1.0 / 4);
          if ((level == 1 || level == 2) && room >= 2) add(i + a, j + b, k + c, 4.0 / 6);
          if (level >= 2 && room >= 3) add(i + a, j + b, k + c, 1.0 / 4);
        }
  Quadrature rule;
  for (int k = 0; k < n; ++k)
    for (int j = 0; j + k < n; ++j)
      for (int i = 0; i + j + k < n; ++i) {
        rule.points.push_back(Vec3(i, j, k) / last);
        rule.weights.push_back(sums[(k * n + j) * n + i] / (static_cast<double>(last) * last * last));
      }
  return rule;
}

/// The triangle shrunk by 1 - w: its Jacobian (1 - w)^2 costs two degrees, so n Gauss points are exact up to 2n - 3.
Quadrature collapsed_tet(int n) {
  const LineRule line = gauss_rule(n);
  const Quadrature triangle = collapsed_triangle(n);
  Quadrature rule;
  for (int k = 0; k < n; ++k)
    for (std::size_t q = 0; q < triangle.points.size(); ++q) {
      const double side = 1 - line.points[k];
      rule.points.push_back(side * triangle.points[q] + line.points[k] * Vec3::UnitZ());
      rule.weights.push_back(3 * side * side * triangle.weights[q] * line.weights[k]);
    }
  return rule;
}

}  // namespace

LineRule trapezoidal_rule(int n) {
  check_count("trapezoidal_rule", n, 2);
  LineRule rule;
  for (int i = 0; i < n; ++i) {
    rule.points.push_back(double(i) / (n - 1));
    rule.weights.push_back((i == 0 || i == n - 1 ? 0.5 : 1.0) / (n - 1));
  }
  return rule;
}

LineRule gauss_rule(int n) {
  check_count("gauss_rule", n, 1);
  LineRule rule;
  for (int i = n; i >= 1; --i) {
    const double t = refine(std::cos(std::numbers::pi * (i - 0.25) / (n + 0.5)), [&](double x) {
      const auto [value, old] = legendre(n, x);
      return value * (x * x - 1) / (n * (x * value - old));
    });
    const double slope = n * (t * legendre(n, t)[0] - legendre(n, t)[1]) / (t * t - 1);
    rule.points.push_back((1 + t) / 2);
    rule.weights.push_back(1 / ((1 - t * t) * slope * slope));
  }
  mirror(rule);
  return rule;
}

LineRule gauss_lobatto_rule(int n) {
  check_count("gauss_lobatto_rule", n, 2);
  LineRule rule;
  for (int i = n - 1; i >= 0; --i) {
    // Zeros of (1 - t^2) P_m', m = n - 1: its derivative is -m (m + 1) P_m.
    const int m = n - 1;
    const double start = std::cos(std::numbers::pi * i / m);
    const double t = i == 0   ? 1
                     : i == m ? -1
                              : refine(start, [&](double x) {
                                  const auto [value, old] = legendre(m, x);
                                  return (x * value - old) / ((m + 1) * value);
                                });
    const double value = legendre(m, t)[0];
    rule.points.push_back((1 + t) / 2);
    rule.weights.push_back(1 / (n * m * value * value));
  }
  mirror(rule);
  return rule;
}

Quadrature make_quadrature(CellKind kind, QuadratureRule rule, int n) {
  check_count("make_quadrature", n, 2);
  const bool trapezoidal = rule == QuadratureRule::trapezoidal;
  if (kind == CellKind::tet) return trapezoidal ? regular_tet(n) : collapsed_tet(n);
  const LineRule line = trapezoidal ? trapezoidal_rule(n) : gauss_lobatto_rule(n);
  Quadrature layer;  // the prism's triangle, the hex's square or the pyramid's base
  if (kind == CellKind::prism) {
    layer = make_triangle_quadrature(rule, n);
  } else {
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i) {
        layer.points.push_back(Vec3(line.points[i], line.points[j], 0));
        layer.weights.push_back(line.weights[i] * line.weights[j]);
      }
  }
  if (kind == CellKind::pyramid) return layer;
  Quadrature result;
  for (int k = 0; k < n; ++k)
    for (std::size_t q = 0; q < layer.points.size(); ++q) {
      result.points.push_back(layer.points[q] + line.points[k] * Vec3::UnitZ());
      result.weights.push_back(layer.weights[q] * line.weights[k]);
    }
  return result;
}

Quadrature make_triangle_quadrature(QuadratureRule rule, int n) {
  check_count("make_triangle_quadrature", n, 2);
  return rule == QuadratureRule::trapezoidal ? regular_triangle(n) : collapsed_triangle(n);
}

int points_for_order(int order) { return order == 1 ? 2 : 2 * order - 1; }

int nested_points_for_order(int order) {
  int n = 2;
  while (n < points_for_order(order)) n = 2 * n - 1;
  return n;
}

}  // namespace subvol::internal
