// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/types.h"

#include <array>
#include <cstddef>
#include <vector>

namespace subvol {

/// One index for every node (i, j) of a square grid of 2^levels x 2^levels quads; i runs fastest.
struct PatchGrid {
  int size = 1;  ///< quads along a side
  std::vector<Index> nodes;
  Index& at(int i, int j) { return nodes[static_cast<std::size_t>(j) * (size + 1) + i]; }
  Index at(int i, int j) const { return nodes[static_cast<std::size_t>(j) * (size + 1) + i]; }
};

/// Lays the descendants of one quad out as a grid.
///
/// quads   corner indices of the refined quads, where child k of quad q is 4 q + k, starts at corner k of its parent and
///         keeps its orientation.
/// patch   the quad's own number before `levels` refinements; its corners 0, 1, 2, 3 are the grid's corners (0, 0),
///         (size, 0), (size, size), (0, size).
PatchGrid patch_grid(const std::vector<std::array<Index, 4>>& quads, std::size_t patch, int levels);

/// Largest distance from points of a limit surface to a coarser tessellation of the same patch.
///
///   max over p of the distance of p to the triangle that holds its parameters
///
/// grid    nodes of the fine grid, numbers of `points`.
/// steps   fine quads along each side of a coarse one, powers of two up to grid.size; coarse quads are cut from their
///         first to their third corner.
double chord_distance(const PatchGrid& grid, const std::vector<Vec3>& points, std::array<int, 2> steps);

}  // namespace subvol
