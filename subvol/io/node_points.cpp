// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/io/node_points.h"

#include <cassert>
#include <cmath>
#include <numbers>

namespace subvol::internal {

namespace {

/// P_n and P_(n-1) at x in [-1, 1].
struct Legendre {
  double value, before;
};
Legendre legendre(int n, double x) {
  double before = 1, value = x;
  for (int k = 2; k <= n; ++k) {
    const double next = ((2 * k - 1) * x * value - (k - 1) * before) / k;
    before = value;
    value = next;
  }
  return {value, before};
}

}  // namespace

std::vector<double> lobatto_points(int order) {
  assert(order >= 1 && order <= 16);
  std::vector<double> points(static_cast<std::size_t>(order) + 1);
  points.front() = 0;
  points.back() = 1;
  for (int i = 1; 2 * i <= order; ++i) {
    // Newton's method for P'_n, written by P_n and P_(n-1); Chebyshev's points are near enough to start from.
    double x = -std::cos(std::numbers::pi * i / order);
    constexpr int kMostLobattoNewtonSteps = 20;  // it takes five or less
    for (int step = 0; step < kMostLobattoNewtonSteps && 2 * i < order; ++step) {
      const auto [value, before] = legendre(order, x);
      const double slope = order * (before - x * value) / (1 - x * x);                       // P'_n
      const double curvature = (2 * x * slope - order * (order + 1) * value) / (1 - x * x);  // P''_n
      x -= slope / curvature;
    }
    if (2 * i == order) x = 0;
    points[static_cast<std::size_t>(i)] = (1 + x) / 2;
    points[static_cast<std::size_t>(order - i)] = 1 - (1 + x) / 2;
  }
  return points;
}

std::vector<Vec3> node_points(CellKind kind, int order, NodeOrdering ordering, NodeSpacing spacing) {
  std::vector<Vec3> points;
  std::vector<double> x;
  if (spacing == NodeSpacing::lobatto) x = lobatto_points(order);
  const auto place = [&](int i) { return x[static_cast<std::size_t>(i)]; };
  for (const LatticePoint& at : cell_lattice(kind, order, ordering)) {
    if (spacing == NodeSpacing::equal) {
      points.push_back(at.cast<double>() / order);
      continue;
    }
    Vec3 p(place(at[0]), place(at[1]), place(at[2]));
    if (kind == CellKind::tet) p /= p.sum() + place(order - at.sum());
    if (kind == CellKind::prism) p.head<2>() /= p[0] + p[1] + place(order - at[0] - at[1]);
    points.push_back(p);
  }
  return points;
}

}  // namespace subvol::internal
