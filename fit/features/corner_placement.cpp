// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/features/corner_placement.h"

#include "subvol/fit/features/corner_clusters.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <tuple>

namespace subvol::internal {

namespace {

// Found on twelve CAD parts. Lengths are in units of h.
/// Corners farther from a vertex get none: the smooth fit rounds them off by about half an edge.
constexpr double kCornerReach = 1.6;
/// Costs of a corner's vertex: for each curve without an edge of the wanted number of cells; if edges are missing.
constexpr double kWrongEdgePenalty = 0.15, kFewEdgesPenalty = 3;
/// Cost of a vertex so far from the corner that only joining paths may end there: more than that of missing edges.
constexpr double kFarPenalty = 4;

}  // namespace

CornerPlacement::CornerPlacement(const RoutingGraph& graph, const SignedFeatures& features,
                                 std::span<const std::uint8_t> followed, std::span<const std::uint8_t> vanishing)
    : graph_(graph),
      h_(graph.edge_length()),
      clusters_(corner_clusters(graph, features, followed, vanishing)),
      taken_(graph.num_vertices(), 0) {
  for (const auto& [corner, cluster] : clusters_) members_[cluster].push_back(corner);
  find_needs(features, followed);
  place();
}

Index CornerPlacement::representative(Index corner) const {
  const auto at = representatives_.find(corner);
  return at == representatives_.end() ? corner : at->second;
}

void CornerPlacement::find_needs(const SignedFeatures& features, std::span<const std::uint8_t> followed) {
  const auto& curves = features.curves.curves;
  for (std::size_t c = 0; c < curves.size(); ++c)
    for (int end = 0; end < 2; ++end) {
      const Index corner = end == 0 ? curves[c].vertices.front() : curves[c].vertices.back();
      if (!followed[c] || !std::ranges::binary_search(features.curves.corners, corner)) continue;
      Needs& needs = needs_[corner];
      needs.position = end == 0 ? curves[c].points.front() : curves[c].points.back();
      ++needs.curves;
      needs.convex += features.is_convex(static_cast<Index>(c));
    }
}

void CornerPlacement::place() {
  std::vector<std::tuple<double, Index, Index>> pairs;  // cost, corner, vertex
  for (const auto& [corner, needs] : needs_)
    for (const Index v : graph_.vertices_near(needs.position, kCornerReach * h_))
      if (distance(needs, v) <= kCornerReach) pairs.push_back({cost(needs, v), corner, v});
  std::sort(pairs.begin(), pairs.end());
  for (const auto& [cost, corner, v] : pairs) {
    if (taken_[v] || vertex_of_corner_.contains(corner)) continue;
    vertex_of_corner_[corner] = v;
    taken_[v] = 1;
  }
}

double CornerPlacement::distance(const Needs& needs, Index v) const {
  return (graph_.position(v) - needs.position).norm() / h_;
}

double CornerPlacement::cost(const Needs& needs, Index v) const {
  int of_one = 0, of_three = 0;
  for (const Index e : graph_.edges_at(v)) {
    of_one += graph_.edges()[e].cells == 1;
    of_three += graph_.edges()[e].cells == 3;
  }
  const int wrong = std::max(0, needs.convex - of_one) + std::max(0, needs.curves - needs.convex - of_three);
  const double d = distance(needs, v);
  const bool few = std::ssize(graph_.edges_at(v)) < needs.curves;
  return d * d + kWrongEdgePenalty * wrong + (few ? kFewEdgesPenalty : 0) + (d > kFollowDistance ? kFarPenalty : 0);
}

Index CornerPlacement::vertex_of(Index corner) const {
  const auto at = vertex_of_corner_.find(representative(corner));
  return at == vertex_of_corner_.end() ? kNoIndex : at->second;
}

Index CornerPlacement::corner_at(Index vertex) const {
  if (!taken_[vertex]) return kNoIndex;
  const auto at = std::ranges::find_if(vertex_of_corner_, [&](const auto& placed) { return placed.second == vertex; });
  return at == vertex_of_corner_.end() ? kNoIndex : at->first;
}

bool CornerPlacement::move(Index corner, const std::function<double(Index)>& extra) {
  const Needs& needs = needs_.at(corner);
  double least = kInfinity;
  Index best = kNoIndex;
  for (const Index v : graph_.vertices_near(needs.position, kFollowDistance * h_)) {
    if (taken_[v] || distance(needs, v) > kFollowDistance) continue;
    const double all = cost(needs, v) + extra(v);
    if (all < least) least = all, best = v;
  }
  if (best == kNoIndex) return false;
  Index& vertex = vertex_of_corner_.at(corner);
  taken_[vertex] = 0;
  taken_[best] = 1;
  vertex = best;
  return true;
}

bool CornerPlacement::share(Index corner, Index other) {
  const auto cluster = clusters_.find(corner), of_other = clusters_.find(other);
  if (cluster == clusters_.end() || of_other == clusters_.end() || cluster->second != of_other->second) return false;
  const Index to = representative(other);
  if (to == corner || vertex_of(to) == kNoIndex) return false;
  for (auto& [shared, place] : representatives_)
    if (place == corner) place = to;
  representatives_[corner] = to;
  needs_[to].curves += needs_[corner].curves;
  needs_[to].convex += needs_[corner].convex;
  needs_.erase(corner);
  if (const auto at = vertex_of_corner_.find(corner); at != vertex_of_corner_.end()) {
    taken_[at->second] = 0;
    vertex_of_corner_.erase(at);
  }
  return true;
}

bool CornerPlacement::share_all(Index corner) {
  const auto cluster = clusters_.find(corner);
  if (cluster == clusters_.end()) return false;
  Index main = kNoIndex;
  for (const Index member : members_.at(cluster->second)) {
    const auto needs = needs_.find(member);
    const bool has_place = needs != needs_.end() && vertex_of(member) != kNoIndex;
    if (has_place && (main == kNoIndex || needs->second.curves > needs_.at(main).curves)) main = member;
  }
  bool any = false;
  for (const Index member : members_.at(cluster->second))
    if (main != kNoIndex && member != main && needs_.contains(member)) any |= share(member, main);
  return any;
}

}  // namespace subvol::internal
