// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/features/curve_search.h"
#include "subvol/fit/features/feature_curves.h"
#include "subvol/fit/features/routing_graph.h"

#include <vector>

namespace subvol::internal {

/// The part of a curve that a path follows, from one place to another (`points_between`).
struct FollowedPart {
  Index curve;
  double from, to;
};

/// A path along a part of a curve.
struct PartPath {
  FollowedPart part;
  std::vector<Index> path;
};

/// Looks for paths along parts of a curve that has none as a whole. The first part is as long as it can be, that of a
/// closed curve at least half of it; others are looked for in the same way in what it leaves out, at least one h away.
/// Each is at least 3 h long.
///
/// search    for the curves of `curves`.  occupied  what the paths may not touch.
/// returns   the parts in the order of the curve, the first place in [0, length); none if they are less than half of
///           the curve. Cost: up to some hundred short searches.
std::vector<PartPath> find_parts(const CurveSearch& search, const RoutingGraph& graph, const FeatureCurves& curves,
                                 Index c, const Occupied& occupied);

}  // namespace subvol::internal
