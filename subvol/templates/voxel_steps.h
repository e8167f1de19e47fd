// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/templates/voxel_topology.h"

#include <vector>

namespace subvol {

/// Fewest steps from one cell to a face neighbour that lead from the cells with `from` to each cell, all on the way
/// with `through`; -1 where there is no way. previous  if given: the cell before, on one such way; kNoIndex for cells
/// with `from` and those not reached.
template <class From, class Through>
std::vector<int> voxel_steps(const VoxelSolid& solid, From&& from, Through&& through,
                             std::vector<Index>* previous = nullptr) {
  std::vector<int> steps(solid.num_cells(), -1);
  if (previous) previous->assign(solid.num_cells(), kNoIndex);
  std::vector<Index> queue;
  for (std::size_t c = 0; c < steps.size(); ++c)
    if (from(static_cast<Index>(c))) {
      steps[c] = 0;
      queue.push_back(static_cast<Index>(c));
    }
  for (std::size_t q = 0; q < queue.size(); ++q) {
    if (!solid.may_flip(queue[q])) continue;  // on the grid's outer layer, beyond which there is nothing
    for (Index offset : solid.face_offsets()) {
      const Index c = queue[q] + offset;
      if (steps[c] >= 0 || !through(c)) continue;
      steps[c] = steps[queue[q]] + 1;
      if (previous) (*previous)[c] = queue[q];
      queue.push_back(c);
    }
  }
  return steps;
}

}  // namespace subvol
