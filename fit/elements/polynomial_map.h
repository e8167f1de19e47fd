// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/elements/high_order_mesh.h"

namespace subvol {

/// Largest orders of the polynomial cells that a file format holds, 1 .. kMaxOrder.
struct OrderLimits {
  int tet = kMaxOrder, prism = kMaxOrder, hex = kMaxOrder;

  int of(CellKind kind) const { return kind == CellKind::tet ? tet : kind == CellKind::prism ? prism : hex; }
};

/// A mesh with the Legendre basis, whose cells are polynomials, and its distance from the map that it stands for.
struct PolynomialMap {
  HighOrderMesh mesh;
  /// Upper bound of |x(u) - y(u)| over all points u of all cells, x: the map, y: the polynomials; in the unit of the
  /// mesh. It is a sum over modes, up to about ten times the true maximum. 0 exactly if the two maps are the same.
  double distance_bound = 0;
};

/// The polynomial map nearest to a mesh among those that a file can hold.
///
/// Each mode phi_i of the mesh is replaced with its projection onto the Legendre modes in the energy product
/// (f', g) on [0, 1]:
///
///   phi_i = sum_j c_ij phi^L_j,   c_ij = (phi_i', (phi^L_j)')
///
/// Every shape function is a product of functions that are linear in one mode (`LocalMode`), so coefficients of edges,
/// faces and cells are transformed each on its own, and neighbours still agree. Terms beyond the orders are dropped;
/// the sum of their largest magnitudes is the bound. Vertices stay.
///
/// Orders: a Legendre mesh keeps its orders as far as the limits allow. For Fourier modes, all orders above 1 are
/// raised together, by the least number for which the bound is at most `wanted_distance`, or else up to the limits.
/// An edge or face has the least limit of the cells around it.
///
/// limits           InputError: outside 1 .. kMaxOrder.
/// wanted_distance  >= 0, in the unit of the mesh; else InputError. It is not a promise: compare `distance_bound`.
/// Deterministic, serial. Cost of a hex at order 4: about 0.1 ms, at order 8: 1 ms.
PolynomialMap polynomial_map(const HighOrderMesh& mesh, const OrderLimits& limits, double wanted_distance);

/// The largest |x(u) - y(u)| over a grid of points of every cell, for two meshes with the same cells in the same order,
/// whatever their orders, bases and vertex numbers.
///
/// samples_per_direction  n >= 2: n^3 points of a hex (`make_quadrature`, trapezoidal). A lower bound of the maximum.
/// InputError: other kinds or numbers of cells; n < 2. Parallel, same bits for any number of threads.
double sampled_distance(const HighOrderMesh& x, const HighOrderMesh& y, int samples_per_direction);

/// Diagonal of the bounding box of the vertices: the length that relative distances between maps refer to.
double vertex_diagonal(const HighOrderMesh& mesh);

}  // namespace subvol
