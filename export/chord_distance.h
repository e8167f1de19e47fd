// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"

#include <array>

namespace subvol::internal {

inline constexpr int kCellSteps = 4;

/// Points of a surface on a grid of kCellSteps x kCellSteps steps; i runs fastest.
struct CellSamples {
  std::array<Vec3, (kCellSteps + 1) * (kCellSteps + 1)> points;
  const Vec3& at(int i, int j) const { return points[j * (kCellSteps + 1) + i]; }
};

/// The tessellation of those points to be judged.
struct ChordQuery {
  std::array<int, 2> steps;          ///< of one of its quads, along each side: 1, 2 or 4
  std::array<bool, 2> hard_sides{};  ///< true if a crease runs along j = 0, and along i = 0
};

/// Returns the largest distance from the points of a surface to a coarser tessellation of the same points.
///
///   max over p of the distance of p to the triangle that holds its parameters
///
/// Quads are cut from their first to their third corner. A point beyond an edge of its triangle is covered by the
/// neighbor there, so only its height over the triangle's plane counts, unless the edge lies on a hard side or the
/// point lies beyond the edge by more than a quarter of the triangle's longest edge.
double chord_distance(const CellSamples& samples, const ChordQuery& query);

}  // namespace subvol::internal
