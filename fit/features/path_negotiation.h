// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/features/curve_search.h"
#include "subvol/fit/features/routing_graph.h"
#include "subvol/fit/features/signed_features.h"

#include <span>
#include <vector>

namespace subvol::internal {

/// Looks for paths of several curves at once that touch one another nowhere but at corners, by negotiated congestion
/// (McMurchie and Ebeling 1995; docs/references.md): at first, paths share vertices and edges. What is shared gets a
/// price, in units of h^3 as the cost of a path, and those that share it are looked for again:
///
///   price = 0.02 * 1.5^round * number of other paths there + 0.1 * number of rounds that ended with several there
///
/// curves  to look for, the most important ones first.
/// base    what no path may touch: the vertices of corners.
/// returns by curve of the features: the paths of the round in which those that share nothing follow the greatest
///         length; of two that share something, the more important one counts. Empty: none. Deterministic, serial.
/// Cost: up to 20 rounds of a search or two for each curve that shares something.
std::vector<std::vector<Index>> negotiated_paths(const RoutingGraph& graph, const FeatureCurves& features,
                                                 std::span<const Index> curves, const Occupied& base,
                                                 CurveSearch& search);

}  // namespace subvol::internal
