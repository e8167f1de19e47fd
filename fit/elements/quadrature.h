// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"
#include "subvol/mesh/cell_topology.h"

#include <vector>

namespace subvol::internal {

/// The rule of a quadrature along a line.
///
///   trapezoidal    equal steps, both ends included; exact for linear functions and, with n points, for cosines
///                  cos(k pi x) up to k = 2n - 3                                Paper: Eq. 6
///   gauss_lobatto  both ends included; exact up to degree 2n - 3
enum class QuadratureRule { trapezoidal, gauss_lobatto };

/// Points of a cell in canonical coordinates, with weights > 0 whose sum is 1: the mean over the cell.
struct Quadrature {
  std::vector<Vec3> points;
  std::vector<double> weights;
};

/// n points per direction: u varies fastest, then v, then w (prism: the triangle's points, then w).
///
/// Triangle and tetrahedron, trapezoidal: the regular grid of n points per side, with the vertex rule on every piece of
/// the regular split (an octahedron among a tet's pieces has equal weights at its vertices); exact for linear
/// functions. Gauss-Lobatto has no such grid: Gauss points in collapsed coordinates are used instead, all in the
/// interior, also exact up to degree 2n - 3.
///
/// Pyramid, for functions that are constant along the rays to its apex, as its Jacobian is: the points of its base.
/// InputError: n < 2. Trapezoidal grids are nested if n - 1 divides n' - 1.
Quadrature make_quadrature(CellKind kind, QuadratureRule rule, int n);
/// Makes the quadrature of the triangle {u + v <= 1}, w = 0, by the same rules.
Quadrature make_triangle_quadrature(QuadratureRule rule, int n);

/// Points per direction for an order >= 1: 2, 3, 5, 7, .. = 2p - 1, but 2 for order 1 (paper: section 3.2).
int points_for_order(int order);
/// Least number of points per direction for a distortion of curved cells: as many as on level 1 of subdivision volumes.
inline constexpr int kLeastDistortionPoints = 5;
/// The smallest 2^k + 1 (or 2) not below that: 2, 3, 5, 9, 9, 17, .. so that grids of all orders are nested.
int nested_points_for_order(int order);

/// Points in (0, 1) or [0, 1], ascending, with weights that sum to 1.
struct LineRule {
  std::vector<double> points, weights;
};
/// At least 1, 2, 2 points, else InputError; exact up to degree 2n - 1, 2n - 3, 1.
LineRule gauss_rule(int n);
LineRule gauss_lobatto_rule(int n);
LineRule trapezoidal_rule(int n);

}  // namespace subvol::internal
