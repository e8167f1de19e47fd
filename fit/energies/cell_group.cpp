// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/energies/cell_group.h"

namespace subvol::internal {

/// Fills the quadrature points and weights, and the values and gradients of the functions there.
void CellGroup::make_tables(Basis basis, QuadratureRule rule) {
  const int n = points_per_direction, m = order + 1;
  Quadrature quadrature = make_quadrature(kind, rule, n);
  points = std::move(quadrature.points);
  weights = std::move(quadrature.weights);
  if (kind == CellKind::hex) {
    const std::size_t num_columns = static_cast<std::size_t>(n) * n;
    const Quadrature by_layers{points, weights};
    for (std::size_t q = 0; q < num_points(); ++q) {
      const std::size_t column = q / n, layer = q % n;
      points[q] = by_layers.points[layer * num_columns + column];
      weights[q] = by_layers.weights[layer * num_columns + column];
    }
  } else {
    num_modes = modes.size();
    ShapeFunctions functions(kind, basis, order);
    products.assign(num_modes, {});
    for (std::size_t q = 0; q < num_points(); ++q) {
      functions.set_point(points[q]);
      for (std::size_t a = 0; a < num_modes; ++a) {
        Vec3 gradient;
        functions.value(modes[a], gradient);
        gradients.push_back(gradient);
        for (int p = 0; p < 6; ++p) products[a][p] += weights[q] * gradient[kPairs[p][0]] * gradient[kPairs[p][1]];
      }
    }
    return;
  }
  num_modes = static_cast<std::size_t>(m) * m * m;
  values.resize(n * m);
  derivatives.resize(n * m);
  std::vector<double> vv(m, 0.0), vd(m, 0.0), dd(m, 0.0);
  const LineRule line = rule == QuadratureRule::trapezoidal ? trapezoidal_rule(n) : gauss_lobatto_rule(n);
  for (int q = 0; q < n; ++q) {
    line_functions(basis, order, line.points[q], &values[q * m], &derivatives[q * m]);
    const double w = line.weights[q];
    for (int i = 0; i < m; ++i) {
      vv[i] += w * values[q * m + i] * values[q * m + i];
      vd[i] += w * values[q * m + i] * derivatives[q * m + i];
      dd[i] += w * derivatives[q * m + i] * derivatives[q * m + i];
    }
  }
  for (int k = 0; k < m; ++k)
    for (int j = 0; j < m; ++j)
      for (int i = 0; i < m; ++i)
        products.push_back({dd[i] * vv[j] * vv[k], vv[i] * dd[j] * vv[k], vv[i] * vv[j] * dd[k], vd[i] * vd[j] * vv[k],
                            vv[i] * vd[j] * vd[k], vd[i] * vv[j] * vd[k]});
}

}  // namespace subvol::internal
