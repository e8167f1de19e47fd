// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"

#include <array>
#include <span>

namespace subvol {

/// |1/6 sum of det(a, b, c)| over the triangles, taken about the first corner. The enclosed volume of a closed,
/// oriented surface; meaningless for others.
double signed_volume(std::span<const Vec3> positions, std::span<const std::array<Index, 3>> triangles);

/// Volume of the grid cells that cannot be reached from outside without crossing the surface, and half of those that it
/// passes through.
///
/// The box of the surface has `resolution` cells along its longest side, >= 1. Orientation does not matter; holes
/// smaller than a cell close themselves. Relative error about area * cell / volume / 10.
double flooded_volume(std::span<const Vec3> positions, std::span<const std::array<Index, 3>> triangles, int resolution);

/// The same for a surface that is known by points on it. It holds back what is outside where points are denser than
/// cells; elsewhere the result is 0.
double flooded_volume(std::span<const Vec3> points, int resolution);

}  // namespace subvol
