// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/templates/search_stop.h"
#include "subvol/templates/voxel_topology.h"

#include <vector>

namespace subvol::internal {

/// Returns for each cell the smallest number of steps between face neighbors that leads to it from a cell with `from`,
/// stepping only onto cells with `through`; -1 if there is no such path. previous: if given, receives for each cell the
/// one before it on such a path; kNoIndex for cells with `from` and those not reached. stop: if given and stopped, the
/// search ends early.
template <class From, class Through>
std::vector<int> voxel_steps(const VoxelSolid& solid, From&& from, Through&& through,
                             std::vector<Index>* previous = nullptr, SearchStop* stop = nullptr) {
  std::vector<int> steps(solid.num_cells(), -1);
  if (previous) previous->assign(solid.num_cells(), kNoIndex);
  std::vector<Index> queue;
  for (std::size_t c = 0; c < steps.size(); ++c)
    if (from(static_cast<Index>(c))) {
      steps[c] = 0;
      queue.push_back(static_cast<Index>(c));
    }
  for (std::size_t q = 0; q < queue.size() && !(stop && stop->is_stopped_at(q)); ++q) {
    if (!solid.may_flip(queue[q])) continue;  // on the grid's outer layer, beyond which there are no cells
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

}  // namespace subvol::internal
