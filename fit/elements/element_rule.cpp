// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/elements/element_rule.h"

#include "subvol/base/error.h"
#include "subvol/fit/elements/quadrature.h"

#include <Eigen/LU>

#include <cmath>

namespace subvol::internal {

namespace {

/// Gradients of all shape functions at a point, in canonical coordinates.
std::vector<Vec3> canonical_gradients(CellKind kind, const Vec3& p) {
  const double u = p[0], v = p[1], w = p[2];
  switch (kind) {
    case CellKind::tet: return {Vec3(-1, -1, -1), Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1)};
    case CellKind::prism: {
      const double t = 1 - u - v;
      return {Vec3(-(1 - w), -(1 - w), -t),
              Vec3(1 - w, 0, -u),
              Vec3(0, 1 - w, -v),
              Vec3(-w, -w, t),
              Vec3(w, 0, u),
              Vec3(0, w, v)};
    }
    case CellKind::pyramid:  // at the base, w = 0: the gradients are the same along each ray to the apex
      return {Vec3(v - 1, u - 1, u * v - 1), Vec3(1 - v, -u, -u * v), Vec3(v, u, u * v), Vec3(-v, 1 - u, -u * v),
              Vec3(0, 0, 1)};
    case CellKind::hex: break;
  }
  const double a = 1 - u, b = 1 - v, c = 1 - w;
  return {Vec3(-b * c, -a * c, -a * b), Vec3(b * c, -u * c, -u * b), Vec3(v * c, u * c, -u * v),
          Vec3(-v * c, a * c, -a * v),  Vec3(-b * w, -a * w, a * b), Vec3(b * w, -u * w, u * b),
          Vec3(v * w, u * w, u * v),    Vec3(-v * w, a * w, a * v)};
}

}  // namespace

Mat3 ideal_matrix(CellKind kind) {
  Mat3 a = Mat3::Identity();
  if (kind == CellKind::tet || kind == CellKind::prism) a.col(1) = Vec3(0.5, std::sqrt(3.0) / 2, 0);
  if (kind == CellKind::tet) a.col(2) = Vec3(0.5, std::sqrt(3.0) / 6, std::sqrt(6.0) / 3);
  if (kind == CellKind::pyramid) a.col(2) = Vec3(0.5, 0.5, std::sqrt(0.5));
  return a;
}

Mat3 ideal_inverse(CellKind kind) { return ideal_matrix(kind).inverse(); }

double ideal_volume(CellKind kind) {
  const double canonical[] = {1.0 / 6, 0.5, 1.0, 1.0 / 3};
  return canonical[static_cast<int>(kind)] * ideal_matrix(kind).determinant();
}

ElementRule make_element_rule(CellKind kind, int points_per_direction) {
  const int n = points_per_direction;
  if (n < 2) throw InputError("make_element_rule: points_per_direction must be at least 2, got " + std::to_string(n));
  // The Jacobian of a linear tet is constant.
  Quadrature quadrature = kind == CellKind::tet ? Quadrature{{Vec3(0.25, 0.25, 0.25)}, {1}}
                                                : make_quadrature(kind, QuadratureRule::trapezoidal, n);
  ElementRule rule;
  rule.kind = kind;
  rule.points = std::move(quadrature.points);
  rule.weights = std::move(quadrature.weights);
  const Mat3 to_ideal = ideal_inverse(kind).transpose();
  rule.offsets.push_back(0);
  for (const Vec3& p : rule.points) {
    const std::vector<Vec3> gradients = canonical_gradients(kind, p);
    for (std::size_t a = 0; a < gradients.size(); ++a) {
      if (gradients[a].squaredNorm() == 0) continue;
      const Vec3 g = to_ideal * gradients[a];
      rule.entries.push_back({static_cast<std::int8_t>(a), {g[0], g[1], g[2]}});
    }
    rule.offsets.push_back(rule.entries.size());
  }
  return rule;
}

}  // namespace subvol::internal
