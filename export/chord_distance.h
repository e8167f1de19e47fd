// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"

#include <array>

namespace subvol {

inline constexpr int kCellSteps = 4;

/// Points of a surface on a grid of kCellSteps x kCellSteps steps; i runs fastest.
struct CellSamples {
  std::array<Vec3, (kCellSteps + 1) * (kCellSteps + 1)> points;
  const Vec3& at(int i, int j) const { return points[j * (kCellSteps + 1) + i]; }
};

/// A tessellation of those points, to be judged.
struct ChordQuery {
  std::array<int, 2> steps;          ///< along each side of one of its quads: 1, 2 or 4
  std::array<bool, 2> hard_sides{};  ///< whether a crease runs along j = 0, and along i = 0
};

/// Largest distance from the points of a surface to a coarser tessellation of the same points.
///
///   max over p of the distance of p to the triangle that holds its parameters
///
/// Quads are cut from their first to their third corner. A point beyond an edge of its triangle is covered by the
/// neighbour there, so only its height over the triangle's plane counts, unless the edge lies on a hard side or the
/// point is out by more than a quarter of the longest edge.
double chord_distance(const CellSamples& samples, const ChordQuery& query);

}  // namespace subvol
