// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/energies/cell_group.h"

#include "subvol/fit/elements/shape_functions.h"

#include <map>
#include <utility>

namespace subvol::internal {

/// For each line function N, the means of N^2, N N' and N'^2.
struct CellGroup::LineProducts {
  std::vector<double> vv, vd, dd;
};

void CellGroup::make_tables(Basis basis, QuadratureRule rule) {
  Quadrature quadrature = make_quadrature(kind, rule, points_per_direction);
  points = std::move(quadrature.points);
  weights = std::move(quadrature.weights);
  if (kind == CellKind::tet) return make_tet_tables(basis, rule);
  const LineProducts line = make_line(basis, rule);
  if (kind == CellKind::prism)
    make_prism_tables(basis, rule, line);
  else
    make_hex_tables(line);
}

CellGroup::LineProducts CellGroup::make_line(Basis basis, QuadratureRule rule) {
  const int n = points_per_direction, m = order + 1;
  values.resize(n * m);
  derivatives.resize(n * m);
  LineProducts means{std::vector<double>(m), std::vector<double>(m), std::vector<double>(m)};
  const LineRule line = rule == QuadratureRule::trapezoidal ? trapezoidal_rule(n) : gauss_lobatto_rule(n);
  for (int q = 0; q < n; ++q) {
    line_functions(basis, order, line.points[q], &values[q * m], &derivatives[q * m]);
    const double w = line.weights[q];
    for (int i = 0; i < m; ++i) {
      means.vv[i] += w * values[q * m + i] * values[q * m + i];
      means.vd[i] += w * values[q * m + i] * derivatives[q * m + i];
      means.dd[i] += w * derivatives[q * m + i] * derivatives[q * m + i];
    }
  }
  return means;
}

void CellGroup::make_hex_tables(const LineProducts& line) {
  const int n = points_per_direction, m = order + 1;
  const std::size_t num_columns = static_cast<std::size_t>(n) * n;
  const Quadrature by_layers{points, weights};
  for (std::size_t q = 0; q < num_points(); ++q) {
    const std::size_t column = q / n, layer = q % n;
    points[q] = by_layers.points[layer * num_columns + column];
    weights[q] = by_layers.weights[layer * num_columns + column];
  }
  num_modes = static_cast<std::size_t>(m) * m * m;
  const auto& [vv, vd, dd] = line;
  for (int k = 0; k < m; ++k)
    for (int j = 0; j < m; ++j)
      for (int i = 0; i < m; ++i)
        products.push_back({dd[i] * vv[j] * vv[k], vv[i] * dd[j] * vv[k], vv[i] * vv[j] * dd[k], vd[i] * vd[j] * vv[k],
                            vv[i] * vd[j] * vd[k], vd[i] * vv[j] * vd[k]});
}

void CellGroup::make_prism_tables(Basis basis, QuadratureRule rule, const LineProducts& line) {
  num_modes = modes.size();
  std::map<LocalMode, std::size_t> numbers;
  for (LocalMode mode : modes) {
    mode.k = 0;  // N_0 is 1 at w = 0
    triangle_function.push_back(numbers.try_emplace(mode, numbers.size()).first->second);
  }
  num_triangle_functions = numbers.size();
  const Quadrature layer = make_triangle_quadrature(rule, points_per_direction);
  triangle_functions.resize(layer.points.size() * num_triangle_functions);
  std::vector<std::array<double, 6>> means(num_triangle_functions, std::array<double, 6>{});  // by kDirectionPairs
  ShapeFunctions functions(kind, basis, order);
  for (std::size_t q = 0; q < layer.points.size(); ++q) {
    functions.set_point(layer.points[q]);
    for (const auto& [mode, number] : numbers) {
      Vec3& f = triangle_functions[q * num_triangle_functions + number];
      const double value = functions.value(mode, f);
      f[2] = value;
      for (int p = 0; p < 6; ++p)
        means[number][p] += layer.weights[q] * f[kDirectionPairs[p][0]] * f[kDirectionPairs[p][1]];
    }
  }
  const auto& [vv, vd, dd] = line;
  products.resize(num_modes);
  for (std::size_t a = 0; a < num_modes; ++a) {
    const std::array<double, 6>& mean = means[triangle_function[a]];
    for (int p = 0; p < 6; ++p) {
      const int along_w = (kDirectionPairs[p][0] == 2) + (kDirectionPairs[p][1] == 2);
      const std::vector<double>& factor = along_w == 0 ? vv : along_w == 1 ? vd : dd;
      products[a][p] = mean[p] * factor[modes[a].k];
    }
  }
}

void CellGroup::make_tet_tables(Basis basis, QuadratureRule rule) {
  num_modes = modes.size();
  products.assign(num_modes, {});
  const bool expands = basis == Basis::legendre;
  ShapeFunctions functions(kind, basis, order);
  for (std::size_t q = 0; q < num_points(); ++q) {
    functions.set_point(points[q]);
    for (std::size_t a = 0; a < num_modes; ++a) {
      Vec3 gradient;
      functions.value(modes[a], gradient);
      if (!expands) gradients.push_back(gradient);
      for (int p = 0; p < 6; ++p)
        products[a][p] += weights[q] * gradient[kDirectionPairs[p][0]] * gradient[kDirectionPairs[p][1]];
    }
  }
  if (!expands) return;
  collapsed = CollapsedBasis(order - 1, rule, points_per_direction);
  expand_gradients(basis);
}

/// The functions are polynomials, so a small quadrature gives the coefficients of their gradients exactly.
void CellGroup::expand_gradients(Basis basis) {
  const int n = order + 1;  // exact up to degree 2 order - 1
  const CollapsedBasis exact(order - 1, QuadratureRule::gauss_lobatto, n);
  const Quadrature quadrature = make_quadrature(kind, QuadratureRule::gauss_lobatto, n);
  ShapeFunctions functions(kind, basis, order);
  gradients.assign(exact.num_functions() * num_modes, Vec3::Zero());
  std::size_t q = 0;
  for (const CollapsedBasis::Layer& layer : exact.layers)
    for (const CollapsedBasis::Row& row : layer.rows)
      for (int point = 0; point < row.num_points; ++point, ++q) {
        functions.set_point(quadrature.points[q]);
        const std::vector<double> psi = exact.values(layer, row, point);
        for (std::size_t a = 0; a < num_modes; ++a) {
          Vec3 gradient;
          functions.value(modes[a], gradient);
          for (std::size_t m = 0; m < psi.size(); ++m)
            gradients[m * num_modes + a] += quadrature.weights[q] * psi[m] * gradient;
        }
      }
}

}  // namespace subvol::internal
