// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/types.h"

#include <array>
#include <span>

namespace subvol {

/// How triangles hang together. Positions decide, not numbers, so that a soup of a closed surface counts as closed.
/// Triangles with two equal corners do not count. Cost: two sorts.
struct SoupTopology {
  /// Share of the half-edges that pair up with an opposite one, in [0, 1]: 1 for a closed, oriented surface, also where
  /// it touches itself along an edge. 0 for no triangles.
  double closed_share = 0;
  /// Vertices - edges + triangles: 2 - 2 * handles for each component of a closed surface.
  long euler_number = 0;
};

SoupTopology soup_topology(std::span<const Vec3> positions, std::span<const std::array<Index, 3>> triangles);

}  // namespace subvol
