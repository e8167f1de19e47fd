// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface/triangle_mesh.h"

#include <cstddef>
#include <optional>

namespace subvol::internal {

/// A surface without its fins.
struct SurfaceWithoutFins {
  TriangleMesh surface;       ///< welded (`welded`)
  std::size_t triangles = 0;  ///< of the fins
  double area_share = 0;      ///< area of the fins, as a share of that of the given surface
};

/// Drops the fins of a surface: parts that stand on an edge of three triangles or more and have a rim.
///
/// returns  nothing if there is no fin, or if nothing else is left. A solid part with a hole that carries a fin is
///          dropped, too: look at `area_share`.
/// InputError: as `surface_parts`. Cost: that of `surface_parts`.
std::optional<SurfaceWithoutFins> without_fins(const TriangleMesh& surface);

}  // namespace subvol::internal
