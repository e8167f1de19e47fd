// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/features/feature_routing.h"

#include "subvol/base/error.h"
#include "subvol/fit/features/corner_placement.h"
#include "subvol/fit/features/path_sides.h"
#include "subvol/fit/features/polyline.h"
#include "subvol/fit/features/routing_graph.h"
#include "subvol/fit/geometry/closest_point.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <optional>
#include <utility>

namespace subvol::internal {

namespace {

// Found on twelve CAD parts, as all constants here without another reason. Lengths are in units of h.
/// Distance within which vertices are looked for, where a path is to pass by a point.
constexpr double kAnchorReach = 1.6;
/// Keeps paths short where the distance says nothing; and the distance at which edges are not looked at.
constexpr double kSoftness = 0.12, kSearchReach = 3;
/// Largest distance between a path and its curve for open curves that would be lost otherwise.
constexpr double kJoinDistance = 2.2;
/// Largest length of a path in units of its curve's: longer ones go to and fro.
constexpr double kMostStretch = 1.8;
/// Distance that one end which joins another path counts as, in the choice among joins.
constexpr double kJoinPenalty = 0.3;
/// Number of edges along another path, from their corner, within which a path may join it; no farther than its middle.
constexpr std::size_t kJoinEdges = 3;
constexpr int kRounds = 8;
/// Cost of a corner's vertex on the path of another curve, for corners that give way.
constexpr double kOnWayPenalty = 1;
/// Curves at which the solid is thinner than this angle, in degrees, are left alone: 0.93 sin(19) = 0.3 is the scaled
/// Jacobian at which cells are given up.
constexpr double kLeastAngle = 19;
/// Shorter curves are left alone, in units of h: no path is as short, and their corners would take vertices that other
/// curves need.
constexpr double kLeastRoutedLength = 0.5;
/// Convex edges below this angle, in degrees, want one cell; up to 180, one or two do equally well.
constexpr double kSharpAngle = 125;

/// Deviation from 180 degrees, in degrees, below which a curve is flat: a border between groups on a smooth surface. It
/// wants two cells.
constexpr double kFlatAngle = 20;

std::array<double, 3> edge_factors(double angle) {
  if (angle < kSharpAngle) return {1, 1.5, 3};
  if (std::abs(angle - 180) < kFlatAngle) return {3, 1, 1.5};
  if (angle < 180) return {1.5, 1.5, 1};
  return {3, 1.5, 1};
}

/// Factors of edges on feature curves of sheets, and of others: a path uses one kind of them.
std::array<double, 3> sheet_factors(bool along_curves) {
  return along_curves ? std::array{1.0, kInfinity, kInfinity} : std::array{kInfinity, 1.0, 1.0};
}

/// A place that a path passes through, at a vertex that is chosen anew for each search.
struct Anchor {
  Vec3 point;
  Index fixed;  ///< the vertex, or kNoIndex if any vertex nearby will do
};

/// Anchors, and the costs between each and the next one.
struct Course {
  std::vector<Anchor> anchors;
  std::vector<FollowingCost> legs;
};

/// A path and how well it follows its curve.
struct Found {
  std::vector<Index> path;
  double gap;  ///< largest distance between the path and the curve, either way, in units of h
};

using Paths = std::vector<std::vector<Index>>;  ///< by curve; empty: none

class Router {
 public:
  Router(const VolumeMesh& mesh, const SignedFeatures& features, const RoutingOptions& options)
      : features_(features),
        curves_(features.curves.curves),
        graph_(mesh, options.on_sheets, options.sizes),
        h_(graph_.edge_length()),
        reasons_(curves_.size()),
        joinable_(curves_.size(), 1),
        courses_(curves_.size()),
        best_(curves_.size()) {
    for (const FeatureCurve& curve : curves_)
      curve_h_.push_back(h_ * graph_.mean_size(sampled_polyline(curve.points, h_ / 2)));
    take(options);
    for (std::size_t c = 0; c < curves_.size(); ++c) trees_.push_back(polyline_tree(curves_[c].points));
    std::vector<std::uint8_t> followed;
    for (std::size_t c = 0; c < curves_.size(); ++c) followed.push_back(is_eligible(static_cast<Index>(c)));
    corners_.emplace(graph_, features, followed);
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
      auto found = find(c, base_);
      if (!found) {
        found = find(c, nothing);
        if (found) has_moved |= move_corners_off(found->path, is_on_way);
      }
      if (found)
        for (const Index v : found->path) is_on_way[v] = 1;
    }
    return has_moved;
  }

  double followed_length() const { return total_length(best_); }

  FeatureRouting run() {
    std::vector<Index> order = order_by_gap();
    for (int round = 0; round < kRounds && !order.empty(); ++round) {
      const std::vector<std::uint8_t> failed = run_round(order);
      const auto has_failed = [&](Index c) { return failed[c] != 0; };
      if (std::ranges::none_of(order, has_failed)) break;
      std::stable_partition(order.begin(), order.end(), has_failed);
    }
    fill_gaps();
    join_lost();
    return result();
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
    for (const auto* list : {&options.excluded, &options.not_joined})
      if (!list->empty() && list->size() != curves_.size())
        throw InputError("route_features: options need one entry for each of the " + std::to_string(curves_.size()) +
                         " curves");
    for (std::size_t c = 0; c < curves_.size(); ++c) {
      if (!options.excluded.empty() && options.excluded[c])
        reasons_[c] = NotFollowed::excluded;
      else if (features_.angles[c] < kLeastAngle)
        reasons_[c] = NotFollowed::too_acute;
      else if (curves_[c].length() < kLeastRoutedLength * curve_h_[c])
        reasons_[c] = NotFollowed::shorter_than_cell;
      if (!options.not_joined.empty() && options.not_joined[c]) joinable_[c] = 0;
    }
    on_sheets_ = options.on_sheets;
    along_curves_ = options.along_sheet_curves;
    along_curves_.resize(curves_.size(), 0);
  }

  bool is_eligible(Index c) const { return !reasons_[c]; }
  bool is_corner(Index v) const { return std::ranges::binary_search(features_.curves.corners, v); }
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

  /// Moves the corners at inner vertices of a path to other vertices near them, if there are some: rather to those that
  /// are not on the ways of other curves. Returns false if all stay.
  bool move_corners_off(std::span<const Index> path, std::span<const std::uint8_t> is_on_way) {
    bool has_moved = false;
    for (const Index v : path.subspan(1, path.size() - 2)) {
      const Index corner = corners_->corner_at(v);
      if (corner == kNoIndex) continue;
      const bool moves = corners_->move(corner, [&](Index w) {
        return std::ranges::find(path, w) != path.end() ? kInfinity : is_on_way[w] ? kOnWayPenalty : 0;
      });
      if (!moves) continue;
      has_moved = true;
      for (std::size_t c = 0; c < curves_.size(); ++c)
        if (corner_at(static_cast<Index>(c), 0) == corner || corner_at(static_cast<Index>(c), 1) == corner)
          courses_[c].clear();
    }
    if (has_moved) base_.vertices = corners_->taken();
    return has_moved;
  }

  // One curve

  std::optional<Found> judged(std::vector<Index> path, Index c, double most) const {
    if (path.size() < 2) return std::nullopt;
    std::vector<Vec3> points;
    for (Index v : path) points.push_back(graph_.position(v));
    if (polyline_length(points) > kMostStretch * curves_[c].length()) return std::nullopt;
    const double spacing = curve_h_[c] / 4;
    const double gap = std::max(farthest(sampled_polyline(points, spacing), trees_[c]),
                                farthest(sampled_polyline(curves_[c].points, spacing), polyline_tree(points))) /
                       curve_h_[c];
    if (!(gap <= most)) return std::nullopt;
    return Found{std::move(path), gap};
  }

  FollowingCost cost_along(Index c, std::span<const Vec3> points) const {
    return {points, on_sheets_ ? sheet_factors(along_curves_[c]) : edge_factors(features_.angles[c]),
            kSoftness * curve_h_[c], kSearchReach * curve_h_[c]};
  }

  Course straight_course(Index c) const {
    const FeatureCurve& curve = curves_[c];
    Course course;
    course.anchors = {{curve.points.front(), vertex_of(curve.vertices.front())},
                      {curve.points.back(), vertex_of(curve.vertices.back())}};
    course.legs.push_back(cost_along(c, curve.points));
    return course;
  }

  /// For curves whose ends are so close that the cheapest path is a short cut.
  Course course_by_middle(Index c) const {
    Course course = straight_course(c);
    const ArcLength arc(curves_[c].points);
    course.anchors.insert(course.anchors.begin() + 1, {arc.at(arc.length() / 2), kNoIndex});
    course.legs.clear();
    course.legs.push_back(cost_along(c, arc.part(0, arc.length() / 2)));
    course.legs.push_back(cost_along(c, arc.part(arc.length() / 2, arc.length())));
    return course;
  }

  /// Around a closed curve in three legs, from its corner or its point nearest to a vertex.
  Course round_course(Index c) const {
    constexpr int kLegs = 3;
    const FeatureCurve& curve = curves_[c];
    const Index corner = curve.vertices.front(), fixed = is_corner(corner) ? vertex_of(corner) : kNoIndex;
    std::vector<Vec3> twice = curve.points;
    twice.insert(twice.end(), curve.points.begin() + 1, curve.points.end());
    const ArcLength arc(twice);
    const double length = arc.length() / 2, start = fixed == kNoIndex ? place_nearest_to_vertex(c) : 0;
    Course course;
    for (int k = 0; k < kLegs; ++k) {
      const double from = start + length * k / kLegs, to = start + length * (k + 1) / kLegs;
      course.anchors.push_back({arc.at(from), k == 0 ? fixed : kNoIndex});
      course.legs.push_back(cost_along(c, arc.part(from, std::min(to, arc.length()))));
    }
    return course;
  }

  /// Returns the place along a curve that is about as near to a vertex as any.
  double place_nearest_to_vertex(Index c) const {
    const std::vector<Vec3> samples = sampled_polyline(curves_[c].points, curve_h_[c] / 8);
    double distance = kInfinity, place = 0, along = 0;
    for (std::size_t i = 0; i < samples.size(); ++i) {
      if (i > 0) along += (samples[i] - samples[i - 1]).norm();
      const double d = (graph_.position(graph_.nearest_vertex(samples[i])) - samples[i]).norm();
      if (d < distance) distance = d, place = along;
    }
    return place;
  }

  /// Returns the courses to try for a curve, in this order.
  std::vector<Course>& courses(Index c) {
    if (courses_[c].empty()) {
      if (curves_[c].closed()) {
        courses_[c].push_back(round_course(c));
      } else {
        courses_[c].push_back(straight_course(c));
        courses_[c].push_back(course_by_middle(c));
      }
    }
    return courses_[c];
  }

  /// Returns a vertex for each anchor: none of them twice, none occupied but fixed ones. Empty if there is none.
  /// allowed  vertices to choose from, ascending; empty: all.
  std::vector<Index> anchor_vertices(const Course& course, double h, const Occupied& occupied,
                                     std::span<const Index> allowed) const {
    std::vector<Index> chosen;
    for (const Anchor& anchor : course.anchors) chosen.push_back(anchor.fixed);
    for (std::size_t i = 0; i < chosen.size(); ++i) {
      double distance = kInfinity;
      if (course.anchors[i].fixed != kNoIndex) continue;
      for (Index v : graph_.vertices_near(course.anchors[i].point, kAnchorReach * h)) {
        if (occupied.vertices[v] || std::ranges::find(chosen, v) != chosen.end()) continue;
        if (!allowed.empty() && !std::ranges::binary_search(allowed, v)) continue;
        const double d = (graph_.position(v) - course.anchors[i].point).norm();
        if (d < distance) distance = d, chosen[i] = v;
      }
      if (chosen[i] == kNoIndex) return {};
    }
    return chosen;
  }

  std::vector<Index> path_on(Course& course, Index c, const Occupied& occupied,
                             std::span<const Index> allowed = {}) const {
    const bool closed = curves_[c].closed();
    const std::vector<Index> anchors = anchor_vertices(course, curve_h_[c], occupied, allowed);
    if (anchors.empty()) return {};
    Occupied taken = occupied;
    for (Index v : anchors) taken.vertices[v] = 1;
    std::vector<Index> path = {anchors[0]};
    for (std::size_t k = 0; k < course.legs.size(); ++k) {
      const Index to = closed ? anchors[(k + 1) % anchors.size()] : anchors[k + 1];
      const std::vector<Index> leg = cheapest_path(graph_, course.legs[k], path.back(), to, taken);
      if (leg.size() < 2) return {};
      taken.add(graph_, leg);
      path.insert(path.end(), leg.begin() + 1, leg.end());
    }
    return path;
  }

  bool lacks_corner(Index c) const {
    const FeatureCurve& curve = curves_[c];
    if (curve.closed()) return false;
    return vertex_of(curve.vertices.front()) == kNoIndex || vertex_of(curve.vertices.back()) == kNoIndex;
  }

  /// Looks for a path of a closed curve on one side of the paths that are there: the vertices nearest to its anchors
  /// may lie on different ones or in dead ends, as along the two edges of a chamfer that is narrower than a cell.
  std::optional<Found> find_on_one_side(Index c, const Occupied& occupied) {
    std::optional<Found> best;
    for (const std::vector<Index>& side :
         path_sides(graph_, sampled_polyline(curves_[c].points, curve_h_[c] / 2), kAnchorReach * curve_h_[c], occupied))
      for (Course& course : courses(c))
        if (auto found = judged(path_on(course, c, occupied, side), c, kFollowDistance))
          if (!best || found->gap < best->gap) best = std::move(found);
    return best;
  }

  std::optional<Found> find(Index c, const Occupied& occupied) {
    if (!(h_ > 0) || lacks_corner(c)) return std::nullopt;
    for (Course& course : courses(c))
      if (auto found = judged(path_on(course, c, occupied), c, kFollowDistance)) return found;
    return curves_[c].closed() ? find_on_one_side(c, occupied) : std::nullopt;
  }

  // All curves

  std::vector<Index> order_by_gap() {
    std::vector<std::pair<double, Index>> order;
    for (std::size_t i = 0; i < curves_.size(); ++i) {
      const auto c = static_cast<Index>(i);
      if (!is_eligible(c)) continue;
      const auto found = find(c, base_);
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
      auto found = find(c, occupied);
      failed[c] = !found;
      if (!found) continue;
      occupied.add(graph_, found->path);
      paths[c] = std::move(found->path);
    }
    const double length = total_length(paths);
    if (length > best_length_ + 1e-9 * h_) {
      best_length_ = length;
      best_ = std::move(paths);
    }
    return failed;
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
      if (auto found = find(c, occupied)) {
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
                                  const std::map<Index, std::vector<Index>>& joinable) const {
    FollowingCost cost = cost_along(c, curves_[c].points);
    double least = kInfinity;
    std::vector<Index> best;
    for (const End& from : possible_ends(c, 0, joinable))
      for (const End& to : possible_ends(c, 1, joinable)) {
        if (from.vertex == to.vertex) continue;
        auto found = judged(cheapest_path(graph_, cost, from.vertex, to.vertex, occupied), c, kJoinDistance);
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
    if (!is_eligible(c)) return {c, *reasons_[c], middle};
    for (int end = 0; end < 2 && lacks_corner(c) && curve.length() >= curve_h_[c]; ++end)
      if (vertex_of(corner_at(c, end)) == kNoIndex)
        return {c, NotFollowed::no_vertex_at_corner, end == 0 ? curve.points.front() : curve.points.back()};
    if (curve.length() < curve_h_[c]) return {c, NotFollowed::shorter_than_cell, middle};
    if (!std::ranges::binary_search(alone_, c)) return {c, NotFollowed::no_path_nearby, middle};
    for (int end = 0; end < 2; ++end)
      if (is_crowded(corner_at(c, end)))
        return {c, NotFollowed::too_many_edges_at_corner, end == 0 ? curve.points.front() : curve.points.back()};
    return {c, NotFollowed::lost_to_neighbor, middle};
  }

  bool is_crowded(Index corner) const {
    const Index v = vertex_of(corner);
    const auto at = std::ranges::lower_bound(features_.curves.corners, corner);
    if (v == kNoIndex || at == features_.curves.corners.end() || *at != corner) return false;
    return std::ssize(graph_.edges_at(v)) < features_.curves.corner_edges[at - features_.curves.corners.begin()];
  }

  /// Records the corner at one end of a path. Returns false if the path joins another one there.
  bool note_corner(Index c, int end, std::vector<PlacedCorner>& corners) const {
    const Index corner = corner_at(c, end), v = end == 0 ? best_[c].front() : best_[c].back();
    if (is_corner(corner) && vertex_of(corner) == v) corners.push_back({corner, v});
    return curves_[c].closed() || vertex_of(corner) == v;
  }

  FeatureRouting result() const {
    FeatureRouting routing;
    for (std::size_t i = 0; i < curves_.size(); ++i) {
      const auto c = static_cast<Index>(i);
      if (best_[c].empty()) {
        routing.unfollowed.push_back(explained(c));
        continue;
      }
      routing.paths.push_back({c, best_[c]});
      const bool front = note_corner(c, 0, routing.corners), back = note_corner(c, 1, routing.corners);
      if (!front || !back) routing.joined.push_back(c);
    }
    std::ranges::sort(routing.corners, {}, &PlacedCorner::vertex);
    routing.corners.erase(std::unique(routing.corners.begin(), routing.corners.end()), routing.corners.end());
    return routing;
  }

  const SignedFeatures& features_;
  const std::vector<FeatureCurve>& curves_;
  RoutingGraph graph_;
  double h_;
  std::vector<double> curve_h_;                      ///< h near each curve
  std::vector<std::optional<NotFollowed>> reasons_;  ///< why a curve is not even tried
  std::vector<std::uint8_t> joinable_;
  bool on_sheets_ = false;
  std::vector<std::uint8_t> along_curves_;
  std::vector<std::vector<Course>> courses_;  ///< by curve, made when first needed
  std::optional<CornerPlacement> corners_;
  Occupied base_;  ///< the vertices of corners
  Paths best_;
  double best_length_ = 0;
  std::vector<ClosestPoint> trees_;  ///< of the curves
  std::vector<Index> alone_;  ///< curves that have a path if no other one has
};

}  // namespace

FeatureRouting route_features(const VolumeMesh& mesh, const SignedFeatures& features, const RoutingOptions& options) {
  Router router(mesh, features, options);
  FeatureRouting routing = router.run();
  if (routing.unfollowed.empty()) return routing;
  Router cleared(mesh, features, options);
  if (!cleared.clear_ways()) return routing;
  FeatureRouting other = cleared.run();
  return cleared.followed_length() > router.followed_length() ? other : routing;
}

}  // namespace subvol::internal
