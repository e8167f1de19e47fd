// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace subvol {

/// Topology of a set of triangles. Corners at equal positions are the same vertex, whatever their numbers, so that a
/// soup of a closed surface is closed. Triangles with two equal corners are ignored. Cost: two sorts.
struct SoupTopology {
  /// Share of the half-edges that pair up with an opposite one, in [0, 1]: 1 for a closed, oriented surface, even if it
  /// touches itself along an edge. 0 if there are no triangles.
  double closed_share = 0;
  /// Vertices - edges + triangles: 2 - 2 * handles for each component of a closed surface.
  long euler_number = 0;
  std::size_t open_edges = 0;     ///< boundary edges, of one triangle
  std::size_t turned_edges = 0;   ///< inconsistently oriented: of two triangles that run the same way
  std::size_t crowded_edges = 0;  ///< non-manifold: of three triangles or more
};

/// rim_parts  if given, is set to the parts of each triangle on the boundary: bit k is set if its edge from corner k to
///            corner k + 1 is a boundary edge, bit 3 + k if its corner k is the end of a boundary edge, its own or
///            another triangle's. 0 for ignored triangles.
SoupTopology soup_topology(std::span<const Vec3> positions, std::span<const std::array<Index, 3>> triangles,
                           std::vector<std::uint8_t>* rim_parts = nullptr);

}  // namespace subvol
