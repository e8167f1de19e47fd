// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/features/corner_placement.h"
#include "subvol/fit/features/curve_parts.h"
#include "subvol/fit/features/feature_routing.h"
#include "subvol/fit/features/routing_task.h"

#include <map>
#include <vector>

namespace subvol::internal {

/// The paths that were found along the curves of a target.
struct PathsOfCurves {
  std::vector<std::vector<Index>> whole;         ///< by curve; empty: none
  std::map<Index, std::vector<PartPath>> parts;  ///< of the curves that were tried in parts; no path: none was found
  std::vector<Index> possible;                   ///< curves that have a path if no other one has; ascending
};

/// Returns the result of `route_features`: the paths, the corners at which they end, and for each curve that is not
/// followed the reason.
FeatureRouting routing_result(const RoutingTask& task, const CornerPlacement& corners, const PathsOfCurves& paths);

}  // namespace subvol::internal
