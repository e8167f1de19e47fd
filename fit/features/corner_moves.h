// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/features/corner_placement.h"
#include "subvol/fit/features/curve_search.h"
#include "subvol/fit/features/feature_routing.h"
#include "subvol/fit/features/routing_graph.h"
#include "subvol/fit/features/routing_task.h"

#include <span>

namespace subvol::internal {

/// Gives vertices to the corners of the eligible curves. task: must outlive the result.
CornerPlacement placed_corners(const RoutingTask& task);

/// Returns what no path may touch even if there is no other path: the vertices of corners.
Occupied occupied_by_corners(const RoutingGraph& graph, const CornerPlacement& corners);

/// Moves vertices of corners out of the way of curves that no path follows otherwise, the longest curves first: the
/// ends of small features may lie on the only path along a long edge. Corners that cannot move share the vertex of the
/// curve's end if they may. Returns false if no corner moves or shares a vertex.
///
/// search  among these corners; it forgets the curves of corners whose vertex changes.
bool clear_ways_of_curves(const RoutingTask& task, CornerPlacement& corners, CurveSearch& search);

/// Lets the corners around the ends of lost curves share vertices. Returns false if none may. A search among these
/// corners must not have looked for paths yet.
bool share_corners_at_ends(const RoutingTask& task, std::span<const UnfollowedCurve> lost, CornerPlacement& corners);

}  // namespace subvol::internal
