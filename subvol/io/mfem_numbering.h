// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/io/cell_lattice.h"
#include "subvol/mesh/volume_mesh.h"

#include <span>
#include <vector>

namespace subvol::internal {

/// The nodes of continuous functions of one order in MFEM's numbering.
struct MfemNodes {
  std::vector<std::size_t> offsets{0};  ///< one per cell, and the end
  std::vector<Index> nodes;             ///< of every cell, in the order of `cell_lattice(kind, order, vtk)`
  std::size_t count = 0;
};

/// Numbers the nodes of linear cells as MFEM's space of continuous functions (H1) does: vertices, then the nodes inside
/// edges, faces and cells.
///
/// Edges and faces are numbered as the cells first name them, in MFEM's order within a cell. Nodes run from the smaller
/// vertex of an edge to the larger; on a face, along the first two vertices of the cell that names it first; inside a
/// cell in rows. Tags, references and positions do not matter.
///
/// order  1 .. 16 (asserted). The count of nodes must fit an Index (asserted).
MfemNodes number_mfem_nodes(std::size_t num_vertices, std::span<const CellKind> kinds,
                            std::span<const std::size_t> cell_offsets, std::span<const Index> cell_vertices, int order);

}  // namespace subvol::internal
