// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/energies/block_sparse.h"
#include "subvol/mesh/volume_mesh.h"

#include <cstddef>
#include <span>
#include <vector>

namespace subvol::internal {

/// Colors the cells greedily, so that cells of one color share no vertex. Returns one color per cell, from 0 on.
std::vector<int> color_cells(const VolumeMesh& mesh);

/// The blocks of a Hessian that couples the vertices of every linear cell: its pattern, and where the blocks of each
/// cell are in it.
class CellBlocks {
 public:
  /// InputError: more pairs of vertices that share a cell than an Index can number (a hex mesh of about 8e7 vertices).
  explicit CellBlocks(const VolumeMesh& mesh);

  /// Returns a zero matrix with one block per pair of vertices that share a cell.
  BlockSparse zero_matrix() const;

  /// Block numbers of a cell's pairs of corners (a, b), a-major: entry n a + b for a cell of n corners.
  const Index* of_cell(std::size_t cell) const { return slots_.data() + offsets_[cell]; }

 private:
  BlockSparse pattern_;               // without blocks
  std::vector<std::size_t> offsets_;  // where each cell begins in slots_
  std::vector<Index> slots_;
};

}  // namespace subvol::internal
