// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"
#include "subvol/mesh/cell_topology.h"

#include <vector>

namespace subvol {

/// A point of the regular grid of a cell: canonical coordinates times the order.
using LatticePoint = Eigen::Vector3i;

/// Returns a point as a key of ordered maps.
inline std::array<int, 3> key_of(const LatticePoint& at) { return {at[0], at[1], at[2]}; }

/// Order in which the points of a cell's grid are listed.
enum class NodeOrdering {
  vtk,   ///< Lagrange cells 71, 72, 73, as numbered in .vtu files from version 2.1 on
  gmsh,  ///< Gmsh's cells of any order; prisms only of order 1 and 2
  rows   ///< u fastest, then v, then w
};

/// Returns the grid points of one kind of cell of an order >= 1: (p+1)^3 of a hex, (p+1)^2 (p+2)/2 of a prism,
/// (p+1)(p+2)(p+3)/6 of a tet; the corners of a pyramid. InputError: an order below 1; a pyramid of an order above 1;
/// for gmsh, a prism of an order above 2.
///
/// VTK and Gmsh both list the corners, then the points inside edges, inside faces, and inside the cell. They differ in
/// the direction of edges and faces and in the order of inner points: rows, or recursively a smaller cell of the same
/// kind with its corners first.
std::vector<LatticePoint> cell_lattice(CellKind kind, int order, NodeOrdering ordering);

/// Returns the number of these points. InputError: as above.
std::size_t num_lattice_points(CellKind kind, int order);

}  // namespace subvol
