// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/features/feature_routing.h"

#include "subvol/fit/features/corner_moves.h"
#include "subvol/fit/features/corner_placement.h"
#include "subvol/fit/features/curve_search.h"
#include "subvol/fit/features/path_joins.h"
#include "subvol/fit/features/path_negotiation.h"
#include "subvol/fit/features/polyline.h"
#include "subvol/fit/features/routing_graph.h"
#include "subvol/fit/features/routing_result.h"
#include "subvol/fit/features/routing_task.h"

#include <algorithm>
#include <cstdint>
#include <functional>
#include <memory>
#include <utility>

namespace subvol::internal {

namespace {

/// Largest number of rounds, each of which starts with the curves that failed in the one before. Found on twelve CAD
/// parts.
constexpr int kMostRoutingRounds = 8;

/// One attempt at paths of all curves, with vertices of its own for the corners.
class RoutingAttempt {
 public:
  RoutingAttempt(const RoutingTask& task, const std::function<bool()>& cancelled)
      : task_(task),
        graph_(task.graph()),
        curves_(task.curves()),
        corners_(placed_corners(task)),
        search_(graph_, task.features(), corners_, task.along_sheet_curves(), cancelled) {
    found_.whole.resize(curves_.size());
  }
  RoutingAttempt(const RoutingAttempt&) = delete;
  RoutingAttempt& operator=(const RoutingAttempt&) = delete;

  // These two come before `run`, if at all. They return false if no corner gets another vertex.
  bool clear_ways() { return clear_ways_of_curves(task_, corners_, search_); }
  bool share_ends(std::span<const UnfollowedCurve> lost) { return share_corners_at_ends(task_, lost, corners_); }

  /// Finds paths of whole curves.
  void run() {
    std::vector<Index> order = order_by_gap();
    for (int round = 0; round < kMostRoutingRounds && !order.empty(); ++round) {
      const std::vector<std::uint8_t> failed = run_round(order);
      const auto has_failed = [&](Index c) { return failed[c] != 0; };
      if (std::ranges::none_of(order, has_failed)) break;
      std::stable_partition(order.begin(), order.end(), has_failed);
    }
    complete();
    negotiate();
  }

  /// Finds paths along parts of the curves that are lost, the longest first.
  void follow_parts() {
    Occupied occupied = occupied_by_paths();
    std::vector<Index> lost = lost_by_length();
    std::ranges::reverse(lost);
    for (const Index c : lost) {
      std::vector<PartPath> parts = find_parts(search_, graph_, task_.features().curves, c, occupied);
      for (const PartPath& part : parts) occupied.add(graph_, part.path);
      found_.parts.insert_or_assign(c, std::move(parts));
    }
  }

  double followed_length() const { return length_; }
  FeatureRouting result() const { return routing_result(task_, corners_, found_); }

 private:
  using Paths = std::vector<std::vector<Index>>;  ///< by curve; empty: none

  /// Returns the eligible curves, those first whose paths follow them best if there are no others.
  std::vector<Index> order_by_gap() {
    const Occupied occupied = occupied_by_corners(graph_, corners_);
    std::vector<std::pair<double, Index>> order;
    for (std::size_t i = 0; i < curves_.size(); ++i) {
      const auto c = static_cast<Index>(i);
      if (!task_.is_eligible(c)) continue;
      const auto found = search_.find(c, occupied);
      if (found) found_.possible.push_back(c);
      order.push_back({found ? found->gap : kInfinity, c});
    }
    std::sort(order.begin(), order.end());
    std::vector<Index> curves;
    for (const auto& [gap, c] : order) curves.push_back(c);
    return curves;
  }

  /// Routes all curves in an order and keeps the result if it is longer than the best one. Marks those that failed.
  std::vector<std::uint8_t> run_round(std::span<const Index> order) {
    Paths paths(curves_.size());
    Occupied occupied = occupied_by_corners(graph_, corners_);
    std::vector<std::uint8_t> failed(curves_.size(), 0);
    for (Index c : order) {
      auto found = search_.find(c, occupied);
      failed[c] = !found;
      if (!found) continue;
      occupied.add(graph_, found->path);
      paths[c] = std::move(found->path);
    }
    if (const double length = total_length(paths); is_longer(length, length_)) {
      length_ = length;
      found_.whole = std::move(paths);
    }
    return failed;
  }

  /// Adds paths of curves that are lost where there is room.
  void complete() {
    fill_gaps();
    join_lost_curves(task_, corners_, search_, lost_by_length(), occupied_by_paths(), found_.whole);
    length_ = total_length(found_.whole);
  }

  void fill_gaps() {
    Occupied occupied = occupied_by_paths();
    for (Index c : lost_by_length())
      if (auto found = search_.find(c, occupied)) {
        occupied.add(graph_, found->path);
        found_.whole[c] = std::move(found->path);
      }
  }

  /// Routes all curves at once if some are lost that have a path alone, and keeps the result if it is longer.
  void negotiate() {
    if (std::ranges::none_of(found_.possible, [&](Index c) { return found_.whole[c].empty(); })) return;
    Paths before =
        std::exchange(found_.whole, negotiated_paths(graph_, task_.features().curves, task_.eligible_by_length(),
                                                     occupied_by_corners(graph_, corners_), search_));
    const double length = length_;
    complete();
    if (is_longer(length_, length)) return;
    found_.whole = std::move(before);
    length_ = length;
  }

  bool is_longer(double length, double other) const { return length > other + 1e-9 * graph_.edge_length(); }

  double total_length(const Paths& paths) const {
    double length = 0;
    for (std::size_t c = 0; c < paths.size(); ++c)
      if (!paths[c].empty()) length += curves_[c].length();
    return length;
  }

  Occupied occupied_by_paths() const {
    Occupied occupied = occupied_by_corners(graph_, corners_);
    for (const auto& path : found_.whole) occupied.add(graph_, path);
    return occupied;
  }

  /// Returns the eligible curves without a path, the shortest first.
  std::vector<Index> lost_by_length() const {
    std::vector<std::pair<double, Index>> lost;
    for (std::size_t c = 0; c < curves_.size(); ++c)
      if (found_.whole[c].empty() && task_.is_eligible(static_cast<Index>(c)))
        lost.push_back({curves_[c].length(), static_cast<Index>(c)});
    std::sort(lost.begin(), lost.end());
    std::vector<Index> curves;
    for (const auto& [length, c] : lost) curves.push_back(c);
    return curves;
  }

  const RoutingTask& task_;
  const RoutingGraph& graph_;
  const std::vector<FeatureCurve>& curves_;
  CornerPlacement corners_;
  CurveSearch search_;   ///< among these corners
  PathsOfCurves found_;  ///< the best so far
  double length_ = 0;    ///< of the curves that are followed as a whole
};

}  // namespace

FeatureRouting route_features(const VolumeMesh& mesh, const SignedFeatures& features, const RoutingOptions& options) {
  const RoutingTask task(mesh, features, options);
  const auto new_attempt = [&] { return std::make_unique<RoutingAttempt>(task, options.cancelled); };
  auto best = new_attempt();
  best->run();
  const std::vector<UnfollowedCurve> lost = best->result().unfollowed;
  if (lost.empty()) return best->result();
  const auto keep_if_longer = [&](std::unique_ptr<RoutingAttempt> other) {
    other->run();
    if (other->followed_length() > best->followed_length()) best = std::move(other);
  };
  const auto is_cancelled = [&] { return options.cancelled && options.cancelled(); };
  if (is_cancelled()) return best->result();
  if (auto cleared = new_attempt(); cleared->clear_ways()) keep_if_longer(std::move(cleared));
  if (is_cancelled()) return best->result();
  if (auto shared = new_attempt(); shared->share_ends(lost)) {
    shared->clear_ways();
    keep_if_longer(std::move(shared));
  }
  if (!options.on_sheets) best->follow_parts();
  return best->result();
}

FeatureRouting without_parts(FeatureRouting routing, std::span<const Index> curves, const FeatureCurves& all) {
  const auto is_named = [&](Index c) { return std::ranges::find(curves, c) != curves.end(); };
  std::erase_if(routing.paths, [&](const CreasePath& path) { return is_named(path.curve); });
  std::erase_if(routing.parts, [&](const FollowedPart& part) { return is_named(part.curve); });
  std::erase_if(routing.corners, [&](const PlacedCorner& corner) {
    return std::ranges::none_of(routing.paths, [&](const CreasePath& path) {
      return path.vertices.front() == corner.vertex || path.vertices.back() == corner.vertex;
    });
  });
  for (UnfollowedCurve& lost : routing.unfollowed) {
    if (!is_named(lost.curve)) continue;
    lost.points = all.curves[lost.curve].points;
    const ArcLength arc(lost.points);
    lost.length = arc.length();
    lost.place = arc.at(arc.length() / 2);
  }
  return routing;
}

double routed_share(const FeatureRouting& routing, const FeatureCurves& curves) {
  double all = 0, lost = 0;
  for (const FeatureCurve& curve : curves.curves) all += curve.length();
  for (const UnfollowedCurve& curve : routing.unfollowed) lost += curve.length;
  return all > 0 ? 1 - lost / all : 1;
}

}  // namespace subvol::internal
