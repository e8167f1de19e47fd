// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/io/cell_lattice.h"
#include "subvol/io/nodal_mesh.h"

#include <vector>

namespace subvol::internal {

/// Returns the Gauss-Lobatto points of [0, 1], ascending: 0, 1 and the zeros of P'_order, order + 1 in all.
///
/// order  1 .. 16 (asserted). Exact to rounding, and symmetric: x_i + x_(order - i) = 1 to the bit.
std::vector<double> lobatto_points(int order);

/// Returns the points of `cell_lattice(kind, order, ordering)` in canonical coordinates. With Gauss-Lobatto spacing, a
/// point of a triangle or tet with the grid coordinates i, j, k and rest l is at x_i, x_j, x_k divided by x_i + x_j +
/// x_k + x_l.
std::vector<Vec3> node_points(CellKind kind, int order, NodeOrdering ordering, NodeSpacing spacing);

}  // namespace subvol::internal
