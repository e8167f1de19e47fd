// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/features/feature_routing.h"

#include "subvol/base/error.h"
#include "subvol/fit/features/corner_clusters.h"
#include "subvol/fit/features/corner_placement.h"
#include "subvol/fit/features/curve_search.h"
#include "subvol/fit/features/path_negotiation.h"
#include "subvol/fit/features/polyline.h"
#include "subvol/fit/features/routing_graph.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <utility>

namespace subvol::internal {

namespace {

// Found on twelve CAD parts, as all constants here without another reason. Lengths are in units of h.
/// Largest distance between a path and its curve for open curves that would be lost otherwise.
constexpr double kJoinDistance = 2.2;
/// Distance that one end which joins another path counts as, in the choice among joins.
constexpr double kJoinPenalty = 0.3;
/// Number of edges along another path, from their corner, within which a path may join it; no farther than its middle.
constexpr std::size_t kJoinEdges = 3;
/// Largest number of rounds in which corners and paths are chosen again, each from the other.
constexpr int kRoutingRounds = 8;
/// Cost of a corner's vertex on the path of another curve, for corners that give way.
constexpr double kOnWayPenalty = 1;
/// Curves at which the solid is thinner than this angle, in degrees, are left alone: 0.93 sin(19) = 0.3 is the scaled
/// Jacobian at which cells are given up.
constexpr double kLeastAngle = 19;

using Paths = std::vector<std::vector<Index>>;  ///< by curve; empty: none

class Router {
 public:
  Router(const VolumeMesh& mesh, const SignedFeatures& features, const RoutingOptions& options)
      : features_(features),
        curves_(features.curves.curves),
        graph_(mesh, options.on_sheets),
        h_(graph_.edge_length()),
        reasons_(curves_.size()),
        joinable_(curves_.size(), 1),
        best_(curves_.size()) {
    take(options);
    std::vector<std::uint8_t> followed, vanishing;
    for (std::size_t c = 0; c < curves_.size(); ++c) {
      followed.push_back(is_eligible(static_cast<Index>(c)));
      vanishing.push_back(reasons_[c] == NotFollowed::shorter_than_cell);
    }
    corners_.emplace(graph_, features, followed, vanishing);
    search_.emplace(graph_, features, *corners_,
                    options.on_sheets ? std::optional(std::span<const std::uint8_t>(along_curves_)) : std::nullopt,
                    options.cancelled);
    base_ = {corners_->taken(), std::vector<std::uint8_t>(graph_.edges().size(), 0)};
  }
  Router(const Router&) = delete;
  Router& operator=(const Router&) = delete;

  /// Moves vertices of corners out of the way of curves that no path follows otherwise, the longest curves first: the
  /// ends of small features may lie on the only path along a long edge. Returns false if none was moved.
  bool clear_ways() {
    const Occupied nothing{std::vector<std::uint8_t>(base_.vertices.size(), 0),
                           std::vector<std::uint8_t>(base_.edges.size(), 0)};
    std::vector<std::uint8_t> is_on_way(base_.vertices.size(), 0);
    bool has_moved = false;
    for (const Index c : eligible_by_length()) {
      auto found = search_->find(c, base_);
      if (!found) {
        found = search_->find(c, nothing);
        if (found) has_moved |= move_corners_off(c, found->path, is_on_way);
      }
      if (found)
        for (const Index v : found->path) is_on_way[v] = 1;
    }
    return has_moved;
  }

  /// Lets the corners around the ends of lost curves share vertices. Returns false if none may.
  bool share_ends(std::span<const UnfollowedCurve> lost) {
    bool any = false;
    for (const UnfollowedCurve& curve : lost)
      for (int end = 0; end < 2; ++end)
        if (is_eligible(curve.curve) && curve.reason != NotFollowed::shorter_than_cell)
          any |= corners_->share_all(corner_at(curve.curve, end));
    if (any) base_.vertices = corners_->taken();
    return any;
  }

  double followed_length() const { return best_length_; }

  /// Finds paths of whole curves.
  void run() {
    std::vector<Index> order = order_by_gap();
    for (int round = 0; round < kRoutingRounds && !order.empty(); ++round) {
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
    Occupied occupied = occupied_by_best();
    std::vector<Index> lost = lost_by_length();
    std::ranges::reverse(lost);
    for (const Index c : lost) {
      std::vector<PartPath> found = find_parts(*search_, graph_, features_.curves, c, occupied);
      for (const PartPath& part : found) occupied.add(graph_, part.path);
      parts_.insert_or_assign(c, std::move(found));
    }
  }

  FeatureRouting result() const {
    FeatureRouting routing;
    for (std::size_t i = 0; i < curves_.size(); ++i) {
      const auto c = static_cast<Index>(i);
      const auto parts = parts_.find(c);
      if (parts != parts_.end() && !parts->second.empty()) {
        for (const auto& [part, path] : parts->second) {
          routing.paths.push_back({c, path});
          routing.parts.push_back(part);
          for (int end = 0; end < 2; ++end) note_corner(c, end, path, routing.corners);
        }
        if (UnfollowedCurve lost = left_out(c, parts->second); lost.length > 0)
          routing.unfollowed.push_back(std::move(lost));
      } else if (best_[c].empty()) {
        routing.unfollowed.push_back(explained(c));
      } else {
        routing.paths.push_back({c, best_[c]});
        const bool front = note_corner(c, 0, best_[c], routing.corners);
        const bool back = note_corner(c, 1, best_[c], routing.corners);
        if (!front || !back) routing.joined.push_back(c);
      }
    }
    std::ranges::sort(routing.corners, {}, [](const PlacedCorner& p) { return std::pair(p.vertex, p.corner); });
    routing.corners.erase(std::unique(routing.corners.begin(), routing.corners.end()), routing.corners.end());
    return routing;
  }

 private:
  struct End {
    Index vertex;
    bool joins;
  };

  void take(const RoutingOptions& options) {
    if (features_.angles.size() != curves_.size())
      throw InputError("route_features: features need one angle for each of the " + std::to_string(curves_.size()) +
                       " curves");
    for (const auto* list : {&options.excluded, &options.not_joined, &options.along_sheet_curves})
      if (!list->empty() && list->size() != curves_.size())
        throw InputError("route_features: options need one entry for each of the " + std::to_string(curves_.size()) +
                         " curves");
    for (std::size_t c = 0; c < curves_.size(); ++c) {
      if (!options.excluded.empty() && options.excluded[c])
        reasons_[c] = NotFollowed::excluded;
      else if (features_.angles[c] < kLeastAngle)
        reasons_[c] = NotFollowed::too_acute;
      else if (curves_[c].length() < kLeastRoutedLength * h_ && !has_edge_on(graph_, curves_[c]))
        reasons_[c] = NotFollowed::shorter_than_cell;
      if (!options.not_joined.empty() && options.not_joined[c]) joinable_[c] = 0;
    }
    along_curves_ = options.along_sheet_curves;
    along_curves_.resize(curves_.size(), 0);
  }

  bool is_eligible(Index c) const { return !reasons_[c]; }
  Index corner_at(Index c, int end) const {
    return end == 0 ? curves_[c].vertices.front() : curves_[c].vertices.back();
  }

  // Corners

  Index vertex_of(Index corner) const { return corners_->vertex_of(corner); }

  /// Curves to be followed, the longest first.
  std::vector<Index> eligible_by_length() const {
    std::vector<std::pair<double, Index>> order;
    for (std::size_t c = 0; c < curves_.size(); ++c)
      if (is_eligible(static_cast<Index>(c))) order.push_back({-curves_[c].length(), static_cast<Index>(c)});
    std::sort(order.begin(), order.end());
    std::vector<Index> curves;
    for (const auto& [length, c] : order) curves.push_back(c);
    return curves;
  }

  /// Moves the corners at inner vertices of a curve's path to other vertices near them, if there are some: rather to
  /// those that are not on the ways of other curves. Others share the vertex of the curve's end if they may. Returns
  /// false if all stay.
  bool move_corners_off(Index c, std::span<const Index> path, std::span<const std::uint8_t> is_on_way) {
    bool has_moved = false;
    for (const Index v : path.subspan(1, path.size() - 2)) {
      const Index corner = corners_->corner_at(v);
      if (corner == kNoIndex) continue;
      const bool moves = corners_->move(corner, [&](Index w) {
        return std::ranges::find(path, w) != path.end() ? kInfinity : is_on_way[w] ? kOnWayPenalty : 0;
      });
      if (!moves && !corners_->share(corner, corner_at(c, 0)) && !corners_->share(corner, corner_at(c, 1))) continue;
      has_moved = true;
      const Index place = corners_->representative(corner);
      for (std::size_t i = 0; i < curves_.size(); ++i)
        for (int end = 0; end < 2; ++end)
          if (corners_->representative(corner_at(static_cast<Index>(i), end)) == place)
            search_->forget(static_cast<Index>(i));
    }
    if (has_moved) base_.vertices = corners_->taken();
    return has_moved;
  }

  // All curves

  std::vector<Index> order_by_gap() {
    std::vector<std::pair<double, Index>> order;
    for (std::size_t i = 0; i < curves_.size(); ++i) {
      const auto c = static_cast<Index>(i);
      if (!is_eligible(c)) continue;
      const auto found = search_->find(c, base_);
      if (found) alone_.push_back(c);
      order.push_back({found ? found->gap : kInfinity, c});
    }
    std::sort(order.begin(), order.end());
    std::vector<Index> curves;
    for (const auto& [gap, c] : order) curves.push_back(c);
    return curves;
  }

  double total_length(const Paths& paths) const {
    double length = 0;
    for (std::size_t c = 0; c < paths.size(); ++c)
      if (!paths[c].empty()) length += curves_[c].length();
    return length;
  }

  /// Routes all curves in an order and keeps the result if it is longer than the best one. Marks those that failed.
  std::vector<std::uint8_t> run_round(std::span<const Index> order) {
    Paths paths(curves_.size());
    Occupied occupied = base_;
    std::vector<std::uint8_t> failed(curves_.size(), 0);
    for (Index c : order) {
      auto found = search_->find(c, occupied);
      failed[c] = !found;
      if (!found) continue;
      occupied.add(graph_, found->path);
      paths[c] = std::move(found->path);
    }
    keep_if_longer(std::move(paths));
    return failed;
  }

  void keep_if_longer(Paths paths) {
    const double length = total_length(paths);
    if (length <= best_length_ + 1e-9 * h_) return;
    best_length_ = length;
    best_ = std::move(paths);
  }

  /// Adds paths of curves that are lost where there is room.
  void complete() {
    fill_gaps();
    join_lost();
    best_length_ = total_length(best_);
  }

  /// Routes all curves at once if some are lost that have a path alone, and keeps the result if it is longer.
  void negotiate() {
    if (std::ranges::none_of(alone_, [&](Index c) { return best_[c].empty(); })) return;
    Paths before =
        std::exchange(best_, negotiated_paths(graph_, features_.curves, eligible_by_length(), base_, *search_));
    const double length = std::exchange(best_length_, 0);
    complete();
    if (best_length_ > length + 1e-9 * h_) return;
    best_ = std::move(before);
    best_length_ = length;
  }

  Occupied occupied_by_best() const {
    Occupied occupied = base_;
    for (const auto& path : best_) occupied.add(graph_, path);
    return occupied;
  }

  std::vector<Index> lost_by_length() const {
    std::vector<std::pair<double, Index>> lost;
    for (std::size_t c = 0; c < curves_.size(); ++c)
      if (best_[c].empty() && is_eligible(static_cast<Index>(c)))
        lost.push_back({curves_[c].length(), static_cast<Index>(c)});
    std::sort(lost.begin(), lost.end());
    std::vector<Index> curves;
    for (const auto& [length, c] : lost) curves.push_back(c);
    return curves;
  }

  void fill_gaps() {
    Occupied occupied = occupied_by_best();
    for (Index c : lost_by_length())
      if (auto found = search_->find(c, occupied)) {
        occupied.add(graph_, found->path);
        best_[c] = std::move(found->path);
      }
  }

  // Joins

  /// Returns, for each vertex at which a path starts or ends, the vertices along it within reach of a join.
  std::map<Index, std::vector<Index>> joinable_vertices() const {
    std::map<Index, std::vector<Index>> vertices;
    for (const auto& path : best_) {
      if (path.empty() || path.front() == path.back()) continue;
      for (std::size_t i = 1; i <= kJoinEdges && 2 * i < path.size(); ++i) {
        vertices[path.front()].push_back(path[i]);
        vertices[path.back()].push_back(path[path.size() - 1 - i]);
      }
    }
    return vertices;
  }

  std::vector<End> possible_ends(Index c, int end, const std::map<Index, std::vector<Index>>& joinable) const {
    const Index vertex = vertex_of(corner_at(c, end));
    if (vertex == kNoIndex) return {};
    std::vector<End> ends = {{vertex, false}};
    if (const auto at = joinable.find(vertex); at != joinable.end())
      for (Index v : at->second) ends.push_back({v, true});
    return ends;
  }

  std::vector<Index> joining_path(Index c, const Occupied& occupied,
                                  const std::map<Index, std::vector<Index>>& joinable) {
    CurveSearch::Straying search(*search_, c, kJoinDistance);
    double least = kInfinity;
    std::vector<Index> best;
    for (const End& from : possible_ends(c, 0, joinable))
      for (const End& to : possible_ends(c, 1, joinable)) {
        if (from.vertex == to.vertex) continue;
        auto found = search.find(from.vertex, to.vertex, occupied);
        if (!found) continue;
        const double judgment = found->gap + kJoinPenalty * (from.joins + to.joins);
        if (judgment < least) least = judgment, best = std::move(found->path);
      }
    return best;
  }

  void join_lost() {
    Occupied occupied = occupied_by_best();
    auto joinable = joinable_vertices();
    for (Index c : lost_by_length()) {
      if (!joinable_[c] || curves_[c].closed() || !(h_ > 0)) continue;
      best_[c] = joining_path(c, occupied, joinable);
      if (best_[c].empty()) continue;
      occupied.add(graph_, best_[c]);
      joinable = joinable_vertices();
    }
  }

  // Report

  UnfollowedCurve explained(Index c) const {
    const FeatureCurve& curve = curves_[c];
    const ArcLength arc(curve.points);
    const Vec3 middle = arc.at(arc.length() / 2);
    const auto because = [&](NotFollowed reason, const Vec3& place) {
      return UnfollowedCurve{c, reason, place, curve.points, arc.length()};
    };
    if (!is_eligible(c)) return because(*reasons_[c], middle);
    for (int end = 0; end < 2 && search_->lacks_corner(c) && curve.length() >= h_; ++end)
      if (vertex_of(corner_at(c, end)) == kNoIndex)
        return because(NotFollowed::no_vertex_at_corner, end == 0 ? curve.points.front() : curve.points.back());
    if (curve.length() < h_) return because(NotFollowed::shorter_than_cell, middle);
    if (!std::ranges::binary_search(alone_, c)) return because(NotFollowed::no_path_nearby, middle);
    for (int end = 0; end < 2; ++end)
      if (has_too_few_edges(corner_at(c, end)))
        return because(NotFollowed::too_many_edges_at_corner, end == 0 ? curve.points.front() : curve.points.back());
    return because(NotFollowed::lost_to_neighbor, middle);
  }

  bool has_too_few_edges(Index corner) const {
    const Index v = vertex_of(corner);
    const auto at = std::ranges::lower_bound(features_.curves.corners, corner);
    if (v == kNoIndex || at == features_.curves.corners.end() || *at != corner) return false;
    return std::ssize(graph_.edges_at(v)) < features_.curves.corner_edges[at - features_.curves.corners.begin()];
  }

  /// Records the corner at one end of a path. Returns false if the path ends elsewhere.
  bool note_corner(Index c, int end, std::span<const Index> path, std::vector<PlacedCorner>& corners) const {
    const Index corner = corner_at(c, end), v = end == 0 ? path.front() : path.back();
    if (features_.curves.is_corner(corner) && vertex_of(corner) == v) corners.push_back({corner, v});
    return curves_[c].closed() || vertex_of(corner) == v;
  }

  /// Returns what the paths along parts of a curve leave out.
  UnfollowedCurve left_out(Index c, std::span<const PartPath> parts) const {
    UnfollowedCurve lost = explained(c);
    const FeatureCurve& curve = curves_[c];
    const double length = curve.length();
    lost.points.clear();
    lost.length = 0;
    double longest = 0;
    const auto leave_out = [&](double from, double to) {
      lost.length += to - from;
      if (to - from <= longest) return;
      longest = to - from;
      lost.points = points_between(curve, from, to);
    };
    const double wrapped = std::max(0.0, parts.back().part.to - length);  // of a closed curve, by its last part
    if (!curve.closed()) leave_out(0, parts.front().part.from);
    for (std::size_t i = 0; i + 1 < parts.size(); ++i) leave_out(parts[i].part.to, parts[i + 1].part.from);
    if (curve.closed())
      leave_out(parts.back().part.to - (wrapped > 0 ? length : 0),
                parts.front().part.from + (wrapped > 0 ? 0 : length));
    else
      leave_out(parts.back().part.to, length);
    if (lost.points.empty()) return lost;
    const ArcLength arc(lost.points);
    lost.place = arc.at(arc.length() / 2);
    return lost;
  }

  const SignedFeatures& features_;
  const std::vector<FeatureCurve>& curves_;
  RoutingGraph graph_;
  double h_;
  std::vector<std::optional<NotFollowed>> reasons_;  ///< why a curve is not even tried
  std::vector<std::uint8_t> joinable_;
  std::vector<std::uint8_t> along_curves_;
  std::optional<CornerPlacement> corners_;
  std::optional<CurveSearch> search_;
  Occupied base_;  ///< the vertices of corners
  Paths best_;
  double best_length_ = 0;
  std::vector<Index> alone_;                      ///< curves that have a path if no other one has
  std::map<Index, std::vector<PartPath>> parts_;  ///< of the curves that were tried in parts
};

}  // namespace

FeatureRouting route_features(const VolumeMesh& mesh, const SignedFeatures& features, const RoutingOptions& options) {
  auto best = std::make_unique<Router>(mesh, features, options);
  best->run();
  const std::vector<UnfollowedCurve> lost = best->result().unfollowed;
  if (lost.empty()) return best->result();
  const auto keep_if_longer = [&](std::unique_ptr<Router> other) {
    other->run();
    if (other->followed_length() > best->followed_length()) best = std::move(other);
  };
  const auto is_cancelled = [&] { return options.cancelled && options.cancelled(); };
  if (is_cancelled()) return best->result();
  if (auto cleared = std::make_unique<Router>(mesh, features, options); cleared->clear_ways())
    keep_if_longer(std::move(cleared));
  if (is_cancelled()) return best->result();
  if (auto shared = std::make_unique<Router>(mesh, features, options); shared->share_ends(lost)) {
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
