// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/elements/collapsed_basis.h"

#include "subvol/base/error.h"

#include <cmath>
#include <string>

namespace subvol::internal {

namespace {

/// Writes P_k^(alpha, 0)(x) for k = 0 .. last to out.
void jacobi_polynomials(int alpha, int last, double x, double* out) {
  out[0] = 1;
  if (last > 0) out[1] = ((alpha + 2) * x + alpha) / 2;
  for (int k = 1; k < last; ++k) {
    const double middle = 2 * k + alpha + 1;
    const double factor = middle * (alpha * alpha + (middle * middle - 1) * x);
    const double previous = 2.0 * (k + alpha) * k * (middle + 1);
    out[k + 1] = (factor * out[k] - previous * out[k - 1]) / (2.0 * (k + 1) * (k + alpha + 1) * (middle - 1));
  }
}

}  // namespace

/// Both rules take all rows from lines of points in [0, 1]: the Gauss points, or equal steps, of which a layer of the
/// regular grid has one fewer than the layer before, and a row one fewer than the row before.
CollapsedBasis::CollapsedBasis(int highest, QuadratureRule rule, int n) : degree(highest) {
  if (degree < 0) throw InputError("CollapsedBasis: the degree must be at least 0, got " + std::to_string(degree));
  if (n < 2) throw InputError("CollapsedBasis: at least 2 points are needed, got " + std::to_string(n));
  if (rule == QuadratureRule::gauss_lobatto) {
    for (double x : gauss_rule(n).points) add_point(x);
  } else {
    add_point(0);  // a vertex: the functions do not depend on the coordinate that is not defined there
    for (int length = 2; length <= n; ++length)
      for (double x : trapezoidal_rule(length).points) add_point(x);
  }
  const auto line = [&](int length) -> std::size_t {  // its first point
    return rule == QuadratureRule::gauss_lobatto ? 0 : static_cast<std::size_t>(length) * (length - 1) / 2;
  };
  const bool shrinks = rule == QuadratureRule::trapezoidal;
  for (int k = 0; k < n; ++k) {
    Layer& layer = layers.emplace_back();
    layer.c = (line(n) + k) * num_pairs();
    const int num_rows = shrinks ? n - k : n;
    for (int j = 0; j < num_rows; ++j) {
      const int num_points = shrinks ? num_rows - j : n;
      layer.rows.push_back({num_points, line(num_points) * num_lines(), (line(num_rows) + j) * num_pairs()});
    }
  }
}

void CollapsedBasis::add_point(double x) {
  const std::size_t first_a = a.size(), first_b = b.size();
  a.resize(first_a + num_lines());
  b.resize(first_b + num_pairs());
  c.resize(b.size());
  jacobi_polynomials(0, degree, 2 * x - 1, &a[first_a]);
  double power = 1;
  for (int i = 0; i <= degree; ++i, power *= 1 - x) {
    a[first_a + i] *= std::sqrt(2.0 * i + 1);
    double *along_b = &b[first_b + first_pair(i)], *along_c = &c[first_b + first_pair(i)];
    jacobi_polynomials(2 * i + 1, degree - i, 2 * x - 1, along_b);
    jacobi_polynomials(2 * i + 2, degree - i, 2 * x - 1, along_c);
    for (int k = 0; i + k <= degree; ++k) {
      along_b[k] *= power;
      along_c[k] *= power * std::sqrt((i + 1.0) * (2.0 * (i + k) + 3) / 3);
    }
  }
}

std::vector<double> CollapsedBasis::values(const Layer& layer, const Row& row, int point) const {
  const double *along_a = &a[row.a + static_cast<std::size_t>(point) * num_lines()], *along_b = &b[row.b],
               *along_c = &c[layer.c];
  std::vector<double> result;
  for (int i = 0; i <= degree; ++i)
    for (int j = 0; i + j <= degree; ++j)
      for (int k = 0; i + j + k <= degree; ++k)
        result.push_back(along_a[i] * along_b[first_pair(i) + j] * along_c[first_pair(i + j) + k]);
  return result;
}

}  // namespace subvol::internal
