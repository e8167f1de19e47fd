// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/export/cell_text.h"
#include "subvol/fit/elements/high_order_mesh.h"
#include "subvol/io/cell_lattice.h"
#include "subvol/io/nodal_mesh.h"

namespace subvol::internal {

/// Returns the polynomials that a reader of Lagrange cells evaluates: in each cell the only one of its order that
/// passes through its points on the regular grid. Positions, Jacobians, certificates and qualities of the result are
/// those of the file.
///
/// returns  a mesh with the Legendre basis in which every cell has its own vertices, in the order of the cells, so that
///          it can represent files whose cells do not fit together.
/// ordering  vtk or gmsh, which list the corners first; rows is refused.
/// InputError: an order out of range, a number of nodes other than that of the cell's kind and order, a node without a
/// point. The points are matched to rounding times the condition of the interpolation, about 1e-11 of the cell's size
/// at order 12. Cost: one factorization for each kind and order (prism of order 12: 1 s), then a product per cell.
HighOrderMesh polynomials_of(const CellView& cells, NodeOrdering ordering, NodeSpacing spacing = NodeSpacing::equal);

/// Returns the same polynomials as one mesh, in which cells with common corners share the modes of their edges and
/// faces: exact up to rounding if they agree there.
///
/// cells    all of one order; corners: the same cells in the same order, by their corners (as `ElementSpace` takes it).
/// InputError: as above, and if two cells differ on an edge or face by more than 1e-6 of a cell's extent.
HighOrderMesh joined_polynomials(const CellView& cells, const VolumeMesh& corners, int order, NodeOrdering ordering,
                                 NodeSpacing spacing);

}  // namespace subvol::internal
