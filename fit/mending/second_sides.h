// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface/triangle_mesh.h"

#include <cstddef>
#include <optional>

namespace subvol::internal {

/// A two-sided surface, as programs for rendering write it, with one side left.
struct OneSidedSurface {
  TriangleMesh surface;     ///< welded (`welded`)
  std::size_t dropped = 0;  ///< triangles
};

/// Drops the second of two triangles with the same corners from a surface of which nearly all triangles are there
/// twice, once with each orientation. A few such pairs are something else: places where solids touch.
///
/// returns  nothing if the surface is not two-sided.
/// InputError, cost: as `welded`.
std::optional<OneSidedSurface> without_second_sides(const TriangleMesh& surface);

}  // namespace subvol::internal
