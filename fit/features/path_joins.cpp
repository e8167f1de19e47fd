// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/features/path_joins.h"

#include <cstddef>
#include <map>
#include <utility>

namespace subvol::internal {

namespace {

// Found on twelve CAD parts. Lengths are in units of h.
/// Largest distance between a path and its curve for open curves that would be lost otherwise.
constexpr double kJoinDistance = 2.2;
/// Distance that one end which joins another path counts as, in the choice among joins.
constexpr double kJoinPenalty = 0.3;
/// Number of edges along another path, from their corner, within which a path may join it; no farther than its middle.
constexpr std::size_t kJoinEdges = 3;

/// The vertices along other paths that are within reach of a join, by the vertex at which those paths start or end.
using JoinableVertices = std::map<Index, std::vector<Index>>;

JoinableVertices joinable_vertices(std::span<const std::vector<Index>> paths) {
  JoinableVertices vertices;
  for (const auto& path : paths) {
    if (path.empty() || path.front() == path.back()) continue;
    for (std::size_t i = 1; i <= kJoinEdges && 2 * i < path.size(); ++i) {
      vertices[path.front()].push_back(path[i]);
      vertices[path.back()].push_back(path[path.size() - 1 - i]);
    }
  }
  return vertices;
}

/// A vertex at which a path may start or end.
struct PossibleEnd {
  Index vertex;
  bool joins;
};

/// corner: the vertex of the corner at that end of the curve, or kNoIndex.
std::vector<PossibleEnd> possible_ends(Index corner, const JoinableVertices& joinable) {
  if (corner == kNoIndex) return {};
  std::vector<PossibleEnd> ends = {{corner, false}};
  if (const auto at = joinable.find(corner); at != joinable.end())
    for (Index v : at->second) ends.push_back({v, true});
  return ends;
}

/// Returns the best path between some ends, or no vertices.
std::vector<Index> joining_path(CurveSearch::Straying search, std::span<const PossibleEnd> starts,
                                std::span<const PossibleEnd> ends, const Occupied& occupied) {
  double least = kInfinity;
  std::vector<Index> best;
  for (const PossibleEnd& from : starts)
    for (const PossibleEnd& to : ends) {
      if (from.vertex == to.vertex) continue;
      auto found = search.find(from.vertex, to.vertex, occupied);
      if (!found) continue;
      const double judgment = found->gap + kJoinPenalty * (from.joins + to.joins);
      if (judgment < least) least = judgment, best = std::move(found->path);
    }
  return best;
}

}  // namespace

void join_lost_curves(const RoutingTask& task, const CornerPlacement& corners, const CurveSearch& search,
                      std::span<const Index> lost, Occupied occupied, std::vector<std::vector<Index>>& paths) {
  if (!(task.graph().edge_length() > 0)) return;
  JoinableVertices joinable = joinable_vertices(paths);
  const auto ends_of = [&](Index c, int end) {
    return possible_ends(corners.vertex_of(task.corner_of(c, end)), joinable);
  };
  for (const Index c : lost) {
    if (!task.may_join(c) || task.curves()[c].closed()) continue;
    paths[c] = joining_path({search, c, kJoinDistance}, ends_of(c, 0), ends_of(c, 1), occupied);
    if (paths[c].empty()) continue;
    occupied.add(task.graph(), paths[c]);
    joinable = joinable_vertices(paths);
  }
}

}  // namespace subvol::internal
