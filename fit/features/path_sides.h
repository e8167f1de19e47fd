// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/features/routing_graph.h"

#include <span>
#include <vector>

namespace subvol::internal {

/// Returns the free vertices near a curve that a closed path could pass through, by the sides on which they lie: paths
/// of other curves are between those of different sides. Vertices in dead ends are on none.
///
/// points    on the curve; vertices within `reach` of one of them are near.
/// occupied  the vertices and edges of the other paths.
/// returns   the vertices of each side, ascending. Deterministic.
std::vector<std::vector<Index>> path_sides(const RoutingGraph& graph, std::span<const Vec3> points, double reach,
                                           const Occupied& occupied);

}  // namespace subvol::internal
