// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"

#include <array>
#include <span>

namespace subvol::internal {

/// Returns |1/6 sum of det(a, b, c)| over the triangles, relative to the first corner: the enclosed volume of a closed,
/// oriented surface, and meaningless for others.
double signed_volume(std::span<const Vec3> positions, std::span<const std::array<Index, 3>> triangles);

/// Returns the volume of the grid cells that cannot be reached from outside without crossing the surface, plus half of
/// those that it passes through. 0 if all cells off the surface can be reached.
///
/// The bounding box of the surface has `resolution` cells along its longest side, >= 1. Orientation does not matter,
/// and holes smaller than a cell are closed. Relative error: about area * cell / volume / 10.
double flooded_volume(std::span<const Vec3> positions, std::span<const std::array<Index, 3>> triangles, int resolution);

/// As above for a surface given by points on it. They stop the flood only if they are denser than the cells; otherwise
/// the result is 0.
double flooded_volume(std::span<const Vec3> points, int resolution);

}  // namespace subvol::internal
