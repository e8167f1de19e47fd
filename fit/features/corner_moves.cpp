// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/features/corner_moves.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace subvol::internal {

namespace {

/// Cost of a corner's vertex on the path of another curve, for corners that give way; found on twelve CAD parts.
constexpr double kOnWayPenalty = 1;

/// Lets a search look anew for the curves that end at a corner or at one that shares its vertex.
void forget_curves_at(Index corner, const RoutingTask& task, const CornerPlacement& corners, CurveSearch& search) {
  const Index place = corners.representative(corner);
  for (std::size_t i = 0; i < task.curves().size(); ++i)
    for (int end = 0; end < 2; ++end)
      if (const auto c = static_cast<Index>(i); corners.representative(task.corner_of(c, end)) == place)
        search.forget(c);
}

/// Moves the corners at inner vertices of a curve's path to other vertices near them, if there are some: rather to
/// those that are not on the ways of other curves. Others share the vertex of the curve's end if they may. Returns
/// false if all stay.
bool move_corners_off(Index c, std::span<const Index> path, std::span<const std::uint8_t> is_on_way,
                      const RoutingTask& task, CornerPlacement& corners, CurveSearch& search) {
  bool has_moved = false;
  for (const Index v : path.subspan(1, path.size() - 2)) {
    const Index corner = corners.corner_at(v);
    if (corner == kNoIndex) continue;
    const bool moves = corners.move(corner, [&](Index w) {
      return std::ranges::find(path, w) != path.end() ? kInfinity : is_on_way[w] ? kOnWayPenalty : 0;
    });
    if (!moves && !corners.share(corner, task.corner_of(c, 0)) && !corners.share(corner, task.corner_of(c, 1)))
      continue;
    has_moved = true;
    forget_curves_at(corner, task, corners, search);
  }
  return has_moved;
}

}  // namespace

CornerPlacement placed_corners(const RoutingTask& task) {
  std::vector<std::uint8_t> followed, vanishing;
  for (std::size_t i = 0; i < task.curves().size(); ++i) {
    const auto c = static_cast<Index>(i);
    followed.push_back(task.is_eligible(c));
    vanishing.push_back(task.reason_against(c) == NotFollowed::shorter_than_cell);
  }
  return {task.graph(), task.features(), followed, vanishing};
}

Occupied occupied_by_corners(const RoutingGraph& graph, const CornerPlacement& corners) {
  return {corners.taken(), std::vector<std::uint8_t>(graph.edges().size(), 0), {}, {}};
}

bool clear_ways_of_curves(const RoutingTask& task, CornerPlacement& corners, CurveSearch& search) {
  Occupied occupied = occupied_by_corners(task.graph(), corners);
  const Occupied nothing{std::vector<std::uint8_t>(occupied.vertices.size(), 0), occupied.edges, {}, {}};
  std::vector<std::uint8_t> is_on_way(occupied.vertices.size(), 0);
  bool has_moved = false;
  for (const Index c : task.eligible_by_length()) {
    auto found = search.find(c, occupied);
    if (!found) {
      found = search.find(c, nothing);
      if (found && move_corners_off(c, found->path, is_on_way, task, corners, search)) {
        has_moved = true;
        occupied.vertices = corners.taken();
      }
    }
    if (found)
      for (const Index v : found->path) is_on_way[v] = 1;
  }
  return has_moved;
}

bool share_corners_at_ends(const RoutingTask& task, std::span<const UnfollowedCurve> lost, CornerPlacement& corners) {
  bool any = false;
  for (const UnfollowedCurve& curve : lost)
    for (int end = 0; end < 2; ++end)
      if (task.is_eligible(curve.curve) && curve.reason != NotFollowed::shorter_than_cell)
        any |= corners.share_all(task.corner_of(curve.curve, end));
  return any;
}

}  // namespace subvol::internal
