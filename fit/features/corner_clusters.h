// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/features/routing_graph.h"
#include "subvol/fit/features/signed_features.h"

#include <cstdint>
#include <map>
#include <span>

namespace subvol::internal {

/// Shorter curves are left alone, in units of h (`route_features`): no path is as short.
inline constexpr double kLeastRoutedLength = 0.5;

/// Finds the corners that may share a vertex, as those of a step or a bevel that is much smaller than an edge: if each
/// has its own, one of them may lie on the only way along a curve that ends at the other.
///
/// Both corners of a curve that vanishes belong to one cluster, the shortest curves first, unless
///
///   - a curve that is followed would begin and end there, or
///   - two of the corners would be farther apart than 0.5 h.
///
/// followed   one entry per curve, not zero for curves that paths are to follow.
/// vanishing  likewise for curves that are too short for a path.
/// returns    for each corner that belongs to a cluster, the smallest number of a corner there. Cost: one sort of the
///            curves that vanish, and the square of the number of corners of each cluster.
std::map<Index, Index> corner_clusters(const RoutingGraph& graph, const SignedFeatures& features,
                                       std::span<const std::uint8_t> followed, std::span<const std::uint8_t> vanishing);

}  // namespace subvol::internal
