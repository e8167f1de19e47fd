// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/features/curve_search.h"

#include "subvol/fit/features/path_sides.h"
#include "subvol/fit/features/polyline.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace subvol::internal {

namespace {

// Found on twelve CAD parts. Lengths are in units of h.
/// Distance within which vertices are looked for, where a path is to pass by a point.
constexpr double kAnchorReach = 1.6;
/// Keeps paths short where the distance says nothing.
constexpr double kSoftness = 0.12;
/// Largest length of a path in units of its curve's: longer ones go to and fro.
constexpr double kMostStretch = 1.8;
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

}  // namespace

CurveSearch::CurveSearch(const RoutingGraph& graph, const SignedFeatures& features, const CornerPlacement& corners,
                         std::optional<std::span<const std::uint8_t>> along_sheet_curves,
                         std::function<bool()> cancelled)
    : graph_(graph),
      features_(features),
      curves_(features.curves.curves),
      corners_(corners),
      along_sheet_curves_(along_sheet_curves),
      cancelled_(std::move(cancelled)),
      h_(graph.edge_length()),
      courses_(curves_.size()) {
  for (const FeatureCurve& curve : curves_) trees_.push_back(polyline_tree(curve.points));
}

/// Returns a path with its gap if it follows a curve, or a part of it: the points `curve`.
std::optional<CurveSearch::Found> CurveSearch::judged(std::vector<Index> path, Index c, std::span<const Vec3> curve,
                                                      double most) const {
  if (path.size() < 2) return std::nullopt;
  std::vector<Vec3> points;
  for (Index v : path) points.push_back(graph_.position(v));
  if (polyline_length(points) > kMostStretch * polyline_length(curve)) return std::nullopt;
  const double spacing = h_ / 4;
  const double distance = std::max(farthest(sampled_polyline(points, spacing), trees_[c]),
                                   farthest(sampled_polyline(curve, spacing), polyline_tree(points)));
  const double gap = distance / h_;
  if (!(gap <= most)) return std::nullopt;
  return Found{std::move(path), gap};
}

CurveWalk CurveSearch::walk_along(Index c, std::vector<Vec3> points, double most) const {
  return {std::move(points),
          along_sheet_curves_ ? sheet_factors((*along_sheet_curves_)[c] != 0) : edge_factors(features_.angles[c]),
          kSoftness * h_, most * h_};
}

CurveSearch::Course CurveSearch::straight_course(Index c) const {
  const FeatureCurve& curve = curves_[c];
  Course course;
  course.anchors = {{curve.points.front(), corners_.vertex_of(curve.vertices.front())},
                    {curve.points.back(), corners_.vertex_of(curve.vertices.back())}};
  course.legs.push_back(walk_along(c, curve.points));
  return course;
}

/// Serves curves that come so close to themselves that the cheapest path passes through a vertex twice.
CurveSearch::Course CurveSearch::course_by_middle(Index c) const {
  Course course = straight_course(c);
  const ArcLength arc(curves_[c].points);
  course.anchors.insert(course.anchors.begin() + 1, {arc.at(arc.length() / 2), kNoIndex});
  course.legs.clear();
  course.legs.push_back(walk_along(c, arc.part(0, arc.length() / 2)));
  course.legs.push_back(walk_along(c, arc.part(arc.length() / 2, arc.length())));
  return course;
}

/// Around a closed curve in three legs, from its corner or its point nearest to a vertex.
CurveSearch::Course CurveSearch::round_course(Index c) const {
  constexpr int kRoundCourseLegs = 3;  // the fewest that go around: two could be the same path, there and back
  const FeatureCurve& curve = curves_[c];
  const Index corner = curve.vertices.front(),
              fixed = features_.curves.is_corner(corner) ? corners_.vertex_of(corner) : kNoIndex;
  std::vector<Vec3> twice = curve.points;
  twice.insert(twice.end(), curve.points.begin() + 1, curve.points.end());
  const ArcLength arc(twice);
  const double length = arc.length() / 2, start = fixed == kNoIndex ? place_nearest_to_vertex(c) : 0;
  Course course;
  for (int k = 0; k < kRoundCourseLegs; ++k) {
    const double from = start + length * k / kRoundCourseLegs, to = start + length * (k + 1) / kRoundCourseLegs;
    course.anchors.push_back({arc.at(from), k == 0 ? fixed : kNoIndex});
    course.legs.push_back(walk_along(c, arc.part(from, std::min(to, arc.length()))));
  }
  return course;
}

/// Returns the place along a curve that is about as near to a vertex as any.
double CurveSearch::place_nearest_to_vertex(Index c) const {
  const std::vector<Vec3> samples = sampled_polyline(curves_[c].points, h_ / 8);
  double distance = kInfinity, place = 0, along = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (i > 0) along += (samples[i] - samples[i - 1]).norm();
    const double d = (graph_.position(graph_.nearest_vertex(samples[i])) - samples[i]).norm();
    if (d < distance) distance = d, place = along;
  }
  return place;
}

/// Returns the courses to try for a curve, in this order.
std::vector<CurveSearch::Course>& CurveSearch::courses(Index c) {
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
std::vector<Index> CurveSearch::anchor_vertices(const Course& course, const Occupied& occupied,
                                                std::span<const Index> allowed) const {
  std::vector<Index> chosen;
  for (const Anchor& anchor : course.anchors) chosen.push_back(anchor.fixed);
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    double least = kInfinity;
    if (course.anchors[i].fixed != kNoIndex) continue;
    for (Index v : graph_.vertices_near(course.anchors[i].point, kAnchorReach * h_)) {
      if (occupied.vertices[v] || std::ranges::find(chosen, v) != chosen.end()) continue;
      if (!allowed.empty() && !std::ranges::binary_search(allowed, v)) continue;
      double cost = (graph_.position(v) - course.anchors[i].point).squaredNorm() * h_;
      if (!occupied.vertex_prices.empty()) cost += occupied.vertex_prices[v];
      if (cost < least) least = cost, chosen[i] = v;
    }
    if (chosen[i] == kNoIndex) return {};
  }
  return chosen;
}

std::vector<Index> CurveSearch::path_on(Course& course, Index c, const Occupied& occupied,
                                        std::span<const Index> allowed) const {
  const bool closed = curves_[c].closed();
  const std::vector<Index> anchors = anchor_vertices(course, occupied, allowed);
  if (anchors.empty()) return {};
  std::vector<Index> path = {anchors[0]}, own = anchors;
  std::ranges::sort(own);
  for (std::size_t k = 0; k < course.legs.size(); ++k) {
    const Index to = closed ? anchors[(k + 1) % anchors.size()] : anchors[k + 1];
    const std::vector<Index> leg = course.legs[k].cheapest_path(graph_, path.back(), to, occupied, own);
    if (leg.size() < 2) return {};
    path.insert(path.end(), leg.begin() + 1, leg.end());
    own.insert(own.end(), leg.begin() + 1, leg.end());
    std::ranges::sort(own);
  }
  return path;
}

bool CurveSearch::lacks_corner(Index c) const {
  const FeatureCurve& curve = curves_[c];
  if (curve.closed()) return false;
  return corners_.vertex_of(curve.vertices.front()) == kNoIndex ||
         corners_.vertex_of(curve.vertices.back()) == kNoIndex;
}

/// Looks for a path of a closed curve on one side of the paths that are there: the vertices nearest to its anchors
/// may lie on different ones or in dead ends, as along the two edges of a chamfer that is narrower than a cell.
std::optional<CurveSearch::Found> CurveSearch::find_on_one_side(Index c, const Occupied& occupied) {
  std::optional<Found> best;
  for (const std::vector<Index>& side :
       path_sides(graph_, sampled_polyline(curves_[c].points, h_ / 2), kAnchorReach * h_, occupied))
    for (Course& course : courses(c))
      if (auto found = judged(path_on(course, c, occupied, side), c, curves_[c].points, kFollowDistance))
        if (!best || found->gap < best->gap) best = std::move(found);
  return best;
}

std::optional<CurveSearch::Found> CurveSearch::find(Index c, const Occupied& occupied) {
  if (!(graph_.edge_length() > 0) || lacks_corner(c) || is_cancelled()) return std::nullopt;
  for (Course& course : courses(c))
    if (auto found = judged(path_on(course, c, occupied), c, curves_[c].points, kFollowDistance)) return found;
  return curves_[c].closed() ? find_on_one_side(c, occupied) : std::nullopt;
}

std::vector<Index> CurveSearch::find_part(Index c, double from, double to, const Occupied& occupied) const {
  const FeatureCurve& curve = curves_[c];
  if (!(graph_.edge_length() > 0) || is_cancelled()) return {};
  const std::vector<Vec3> points = points_between(curve, from, to);
  const bool has_front = !curve.closed() && from == 0, has_back = !curve.closed() && to == curve.length();
  Course course;
  course.anchors = {{points.front(), has_front ? corners_.vertex_of(curve.vertices.front()) : kNoIndex},
                    {points.back(), has_back ? corners_.vertex_of(curve.vertices.back()) : kNoIndex}};
  course.legs.push_back(walk_along(c, points));
  auto found = judged(path_on(course, c, occupied), c, points, kFollowDistance);
  return found ? std::move(found->path) : std::vector<Index>();
}

CurveSearch::Straying::Straying(const CurveSearch& search, Index c, double most)
    : search_(search), curve_(c), most_(most), walk_(search.walk_along(c, search.curves_[c].points, most)) {}

std::optional<CurveSearch::Found> CurveSearch::Straying::find(Index from, Index to, const Occupied& occupied) {
  if (search_.is_cancelled()) return std::nullopt;
  return search_.judged(walk_.cheapest_path(search_.graph_, from, to, occupied), curve_, search_.curves_[curve_].points,
                        most_);
}

}  // namespace subvol::internal
