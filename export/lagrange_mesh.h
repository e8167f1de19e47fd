// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/elements/high_order_mesh.h"
#include "subvol/io/cell_lattice.h"

#include <span>
#include <vector>

namespace subvol::internal {

/// Points of the regular grids of all cells; each point on common vertices, edges and faces occurs once.
///
/// An edge or face is shared by its cells of equal order; cells of different orders have separate points on it.
struct LagrangeMesh {
  std::vector<Vec3> positions;  ///< the mesh's vertices with their numbers, then the other points
  std::vector<CellKind> kinds;
  std::vector<int> orders;  ///< one per cell
  std::vector<std::size_t> cell_offsets{0};
  std::vector<Index> cell_nodes;  ///< points of every cell, in the order of `cell_lattice`

  std::size_t num_cells() const { return kinds.size(); }
  std::span<const Index> cell(std::size_t c) const {
    return {cell_nodes.data() + cell_offsets[c], cell_offsets[c + 1] - cell_offsets[c]};
  }
};

/// Samples the cells on grids of the given orders, one per cell, >= 1. Cells that are polynomials of that order
/// (Legendre: every cell at its order from `lagrange_orders`) are reproduced everywhere, all others only at the points.
///
/// InputError: a wrong number of orders, an order that `cell_lattice` refuses, pyramids. Parallel; the same bits for
/// any number of threads.
LagrangeMesh lagrange_mesh(const HighOrderMesh& mesh, std::span<const int> orders, NodeOrdering ordering);

/// Makes the points of a mesh in the order of VTK the control points of the same polynomials
/// (`nodes_to_control_points`). Numbers and orders stay the same.
void use_control_points(LagrangeMesh& mesh);

/// Returns for every cell the largest order of its edges, faces and interior, but no more than `limit`.
std::vector<int> lagrange_orders(const ElementSpace& space, int limit);

/// Returns the curved cells as many small linear ones: n^3 hexes per hex, n^3 prisms per prism, n^3 tets per tet.
///
/// The result is conforming like the mesh: all edges are cut alike, at equal parameters. n = 1 gives the straight-sided
/// mesh itself.
/// intervals  n >= 1, else InputError; InputError also if there would be more than 2^31 - 1 cells. parents: receives
///            the cell of each small one; may be null.
VolumeMesh linear_cells(const HighOrderMesh& mesh, int intervals, std::vector<Index>* parents = nullptr);

}  // namespace subvol::internal
