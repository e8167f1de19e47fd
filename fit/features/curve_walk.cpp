// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/features/curve_walk.h"

#include <algorithm>
#include <cstddef>
#include <functional>
#include <map>
#include <queue>
#include <utility>

namespace subvol::internal {

namespace {

/// Length of the polyline that an edge may pass by, in lengths of the edge.
constexpr double kMostPassed = 3;

}  // namespace

CurveWalk::CurveWalk(std::vector<Vec3> points, std::array<double, 3> factors, double softness, double reach)
    : points_(std::move(points)), along_{0}, factors_(factors), softness_(softness), reach_(reach) {
  points_.erase(std::unique(points_.begin(), points_.end()), points_.end());
  if (points_.size() == 1) points_.push_back(points_.front());
  for (std::size_t i = 0; i + 1 < points_.size(); ++i)
    along_.push_back(along_.back() + (points_[i + 1] - points_[i]).norm());
}

/// Returns the places where the distance to a vertex has a local minimum within reach, in the polyline's direction.
const std::vector<CurveWalk::Place>& CurveWalk::places(const RoutingGraph& graph, Index v) {
  const auto [at, added] = places_.try_emplace(v);
  if (!added) return at->second;
  const Vec3& p = graph.position(v);
  bool comes_from_end = true;  // the segment before is nearest at its end, or there is none
  for (std::size_t i = 0; i + 1 < points_.size(); ++i) {
    const Vec3 step = points_[i + 1] - points_[i];
    const double squared_length = step.squaredNorm();
    const double share = squared_length > 0 ? step.dot(p - points_[i]) / squared_length : 0;
    const bool is_last = i + 2 == points_.size();
    if ((share > 0 || comes_from_end) && (share < 1 || is_last)) {
      const double t = std::clamp(share, 0.0, 1.0), squared_distance = (p - points_[i] - t * step).squaredNorm();
      if (squared_distance <= reach_ * reach_)
        at->second.push_back({along_[i] + t * (along_[i + 1] - along_[i]), squared_distance});
    }
    comes_from_end = share >= 1;
  }
  return at->second;
}

/// Returns the places at which a path that begins or ends at a vertex may do so.
std::vector<CurveWalk::Place> CurveWalk::places_at_end(const RoutingGraph& graph, Index v, bool at_start) {
  const double end = at_start ? 0 : along_.back();
  const Vec3& point = at_start ? points_.front() : points_.back();
  std::vector<Place> result = {{end, (graph.position(v) - point).squaredNorm()}};
  for (const Place& place : places(graph, v))
    if (std::abs(place.along - end) <= 2 * reach_) result.push_back(place);
  return result;
}

double CurveWalk::cost(const RoutingGraph& graph, Index edge, Index v, const Place& from, Index w,
                       const Place& to) const {
  const Vec3 &a = graph.position(v), &b = graph.position(w);
  const double length = (b - a).norm();
  if (std::abs(to.along - from.along) > kMostPassed * length) return kInfinity;
  const double half_way = (from.along + to.along) / 2;
  const auto next =
      std::min<std::ptrdiff_t>(std::ranges::upper_bound(along_, half_way) - along_.begin(), std::ssize(along_) - 1);
  const double segment = along_[next] - along_[next - 1];
  const double t = segment > 0 ? (half_way - along_[next - 1]) / segment : 0;
  const Vec3 passed = points_[next - 1] + t * (points_[next] - points_[next - 1]);
  const double middle = (0.5 * (a + b) - passed).squaredNorm();
  const double mean = (from.squared_distance + 2 * middle + to.squared_distance) / 4 + softness_ * softness_;
  return length * mean * factors_[std::clamp(graph.edges()[edge].cells, 1, 3) - 1];
}

std::vector<Index> CurveWalk::cheapest_path(const RoutingGraph& graph, Index from, Index to, const Occupied& occupied,
                                            std::span<const Index> others) {
  using State = std::pair<Index, std::size_t>;  // a vertex, and the number of its place
  struct Reached {
    double cost;
    State from;
  };
  const std::vector<Place> starts = places_at_end(graph, from, true), ends = places_at_end(graph, to, false);
  const auto places_of = [&](Index v) -> const std::vector<Place>& {
    return v == from ? starts : v == to ? ends : places(graph, v);
  };
  const bool has_prices = !occupied.vertex_prices.empty();
  std::map<State, Reached> reached;
  using Entry = std::pair<double, State>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  for (std::size_t i = 0; i < starts.size(); ++i) {
    reached[{from, i}] = {0, {kNoIndex, 0}};
    queue.push({0, {from, i}});
  }
  State state{kNoIndex, 0};
  while (!queue.empty()) {
    const auto [so_far, reached_state] = queue.top();
    queue.pop();
    state = reached_state;
    const auto [v, number] = state;
    if (v == to) break;
    if (so_far > reached.at(state).cost) continue;
    const Place place = places_of(v)[number];
    for (const Index e : graph.edges_at(v)) {
      const Index w = graph.other_end(e, v);
      if (w == from || occupied.edges[e]) continue;
      if (w != to && (occupied.vertices[w] || std::ranges::binary_search(others, w))) continue;
      const double price = has_prices ? occupied.edge_prices[e] + (w == to ? 0 : occupied.vertex_prices[w]) : 0;
      const std::vector<Place>& next_places = places_of(w);
      for (std::size_t i = 0; i < next_places.size(); ++i) {
        const double next = so_far + price + cost(graph, e, v, place, w, next_places[i]);
        if (next == kInfinity) continue;
        const auto [at, added] = reached.try_emplace({w, i}, Reached{kInfinity, {}});
        if (next >= at->second.cost) continue;
        at->second = {next, state};
        queue.push({next, {w, i}});
      }
    }
  }
  if (state.first != to) return {};
  std::vector<Index> path;
  for (; state.first != kNoIndex; state = reached.at(state).from) path.push_back(state.first);
  std::ranges::reverse(path);
  std::vector<Index> sorted = path;
  std::ranges::sort(sorted);
  return std::ranges::adjacent_find(sorted) == sorted.end() ? path : std::vector<Index>();
}

}  // namespace subvol::internal
