// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/lagrange_lattice.h"
#include "fit/elements/high_order_mesh.h"

#include <span>
#include <vector>

namespace subvol {

/// Points of the regular grids of all cells, those on common vertices, edges and faces once.
///
/// A common edge or face is shared by the cells that have the same order; where orders differ, each has points of its
/// own.
struct LagrangeMesh {
  std::vector<Vec3> positions;  ///< the mesh's vertices with their numbers, then the other points
  std::vector<CellKind> kinds;
  std::vector<int> orders;      ///< one per cell
  std::vector<std::size_t> cell_offsets{0};
  std::vector<Index> cell_nodes;///< points of every cell, as `cell_lattice` lists them

  std::size_t num_cells() const { return kinds.size(); }
  std::span<const Index> cell(std::size_t c) const {
    return {cell_nodes.data() + cell_offsets[c], cell_offsets[c + 1] - cell_offsets[c]};
  }
};

/// Samples the cells on grids of the given orders, one per cell, >= 1. What is polynomial of that order (legendre:
/// every cell at its `lagrange_orders`) is met everywhere, all else at the points.
///
/// InputError: wrong number of orders, what `cell_lattice` refuses. Parallel, same bits for any number of threads.
LagrangeMesh lagrange_mesh(const HighOrderMesh& mesh, std::span<const int> orders, NodeOrdering ordering);

/// For every cell the largest order of its edges, faces and itself, but no more than `limit`.
std::vector<int> lagrange_orders(const ElementSpace& space, int limit);

/// The curved cells as many small linear ones: n^3 hexes of a hex, n^3 prisms of a prism, n^3 tets of a tet.
///
/// Conforming as the mesh is: all edges are cut alike, at equal parameters. With 1 the straight-sided mesh itself.
/// intervals  n >= 1, else InputError, as when there were more than 2^31 - 1 cells. parents: cell of each small one, or
///            null.
VolumeMesh linear_cells(const HighOrderMesh& mesh, int intervals, std::vector<Index>* parents = nullptr);

}  // namespace subvol
