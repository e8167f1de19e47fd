// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/elements/high_order_mesh.h"

namespace subvol {

/// Largest orders of polynomial cells that a file format supports, 1 .. kMaxOrder.
struct OrderLimits {
  int tet = kMaxOrder, prism = kMaxOrder, hex = kMaxOrder;

  int of(CellKind kind) const { return kind == CellKind::tet ? tet : kind == CellKind::prism ? prism : hex; }
};

/// A mesh with the Legendre basis, whose cells are polynomials, and its distance from the map that it represents.
struct PolynomialMap {
  HighOrderMesh mesh;
  /// Upper bound of |x(u) - y(u)| over all points u of all cells, x the map and y the polynomials, in the unit of the
  /// mesh. It is a sum over modes, up to about ten times the true maximum. 0 exactly if the two maps are the same.
  double distance_bound = 0;
};

/// Approximates a mesh by a polynomial map that a file can hold.
///
/// Each mode phi_i of the mesh is replaced by its projection onto the Legendre modes in the energy product (f', g') on
/// [0, 1]:
///
///   phi_i = sum_j c_ij phi^L_j,   c_ij = (phi_i', (phi^L_j)')
///
/// Every shape function is a product of functions that are linear in one mode (`LocalMode`), so the coefficients of
/// each edge, face and cell are transformed on their own, and neighbors still agree. Terms beyond the orders are
/// dropped; the sum of their largest magnitudes is the bound. Vertices stay.
///
/// Orders: a Legendre mesh keeps its orders as far as the limits allow. For Fourier modes, all orders above 1 are
/// raised by the same number: the smallest for which the bound is at most `wanted_distance`, or else up to the limits.
/// The limit of an edge or face is the lowest of the cells around it.
///
/// limits           InputError: outside 1 .. kMaxOrder.
/// wanted_distance  >= 0, in the unit of the mesh; else InputError. It may not be reached: compare `distance_bound`.
/// Deterministic, serial. Cost of a hex at order 4: about 0.1 ms, at order 8: 1 ms.
PolynomialMap polynomial_map(const HighOrderMesh& mesh, const OrderLimits& limits, double wanted_distance);

/// Returns the largest |x(u) - y(u)| over a grid of points of every cell, for two meshes with the same cells in the
/// same order, whatever their orders, bases and vertex numbers.
///
/// samples_per_direction  n >= 2: n^3 points for a hex (`make_quadrature`, trapezoidal). A lower bound of the maximum.
/// InputError: the kinds or numbers of cells differ; n < 2. Runs in parallel, with the same bits for any number of
/// threads.
double sampled_distance(const HighOrderMesh& x, const HighOrderMesh& y, int samples_per_direction);

/// Returns the diagonal of the bounding box of the vertices: the length that relative distances between maps refer to.
double vertex_diagonal(const HighOrderMesh& mesh);

}  // namespace subvol
