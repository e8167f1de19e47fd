// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace subvol {

/// How triangles hang together. Positions decide, not numbers, so that a soup of a closed surface counts as closed.
/// Triangles with two equal corners do not count. Cost: two sorts.
struct SoupTopology {
  /// Share of the half-edges that pair up with an opposite one, in [0, 1]: 1 for a closed, oriented surface, also where
  /// it touches itself along an edge. 0 for no triangles.
  double closed_share = 0;
  /// Vertices - edges + triangles: 2 - 2 * handles for each component of a closed surface.
  long euler_number = 0;
  std::size_t open_edges = 0;     ///< of one triangle: rims of holes, or of the surface
  std::size_t turned_edges = 0;   ///< of two triangles that run the same way along them
  std::size_t crowded_edges = 0;  ///< of three triangles and more
};

SoupTopology soup_topology(std::span<const Vec3> positions, std::span<const std::array<Index, 3>> triangles);

/// What of each triangle is on a rim: bit k where its edge from corner k to corner k + 1 is open, bit 3 + k where its
/// corner k is the end of an open edge, its own or another triangle's. 0 for triangles that do not count.
std::vector<std::uint8_t> rim_parts(std::span<const Vec3> positions, std::span<const std::array<Index, 3>> triangles);

}  // namespace subvol
