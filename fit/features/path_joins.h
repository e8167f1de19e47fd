// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/features/corner_placement.h"
#include "subvol/fit/features/curve_search.h"
#include "subvol/fit/features/routing_graph.h"
#include "subvol/fit/features/routing_task.h"

#include <span>
#include <vector>

namespace subvol::internal {

/// Looks for paths of lost open curves that may stray farther from them than others, and start or end inside the path
/// of another curve of the same corner ("join", `route_features`).
///
/// lost      curves without a path, in the order in which they are tried. Those that may not join are passed over.
/// occupied  the vertices of corners and all paths.
/// paths     by curve; empty: none. Those that are found are added.
void join_lost_curves(const RoutingTask& task, const CornerPlacement& corners, const CurveSearch& search,
                      std::span<const Index> lost, Occupied occupied, std::vector<std::vector<Index>>& paths);

}  // namespace subvol::internal
