// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/io/nodal_mesh.h"

#include <span>
#include <vector>

namespace subvol::internal {

/// The nodes of cells, each cell with all points of its grid in the order of `NodeOrdering::vtk`.
struct CellNodes {
  std::span<const CellKind> kinds;
  std::span<const int> orders;           ///< one per cell
  std::span<const std::size_t> offsets;  ///< one more than cells
  std::span<const Index> nodes;

  std::span<const Index> cell(std::size_t c) const { return nodes.subspan(offsets[c], offsets[c + 1] - offsets[c]); }
};

/// Replaces the nodes of cells (at equal distances, `NodeSpacing::equal`) by the control points of the same
/// polynomials: their coefficients in the Bernstein basis, which VTK's Bezier cells 78, 79 and 80 hold in the places of
/// the nodes.
///
/// Corners stay to the bit. A control point on an edge or face depends on the nodes of that edge or face only, so cells
/// that share these nodes share the control points up to rounding; the first of the cells decides. Relative errors are
/// about 1e-12 at order 12.
void nodes_to_control_points(std::vector<Vec3>& positions, const CellNodes& cells);

/// Replaces the control points of some cells of a mesh by their nodes.
///
/// beziers     numbers of the cells, ascending.
/// InputError: two cells share a point that is no corner of them, but not the edge or face that it lies on, so that it
/// would have to be in two places.
void control_points_to_nodes(NodalMesh& mesh, std::span<const std::size_t> beziers);

}  // namespace subvol::internal
