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

/// A coarser tessellation of a patch, to be judged.
struct ChordQuery {
  std::array<int, 2> steps;          ///< fine quads along each side of a coarse one, powers of two up to the grid's size
  std::array<bool, 2> hard_sides{};  ///< whether a crease runs along j = 0, and along i = 0
};

/// Largest distance from points of a limit surface to a coarser tessellation of the same patch.
///
///   max over p of the distance of p to the triangle that holds its parameters
///
/// A point beyond an edge of that triangle is covered by the neighbour there, so only its height over the triangle's
/// plane counts, unless the edge lies on a hard side or the point is out by more than a quarter of the longest edge.
///
/// grid    nodes of the fine grid, numbers of `points`; coarse quads are cut from their first to their third corner.
double chord_distance(const PatchGrid& grid, const std::vector<Vec3>& points, const ChordQuery& query);

}  // namespace subvol
