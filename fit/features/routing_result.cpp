// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/features/routing_result.h"

#include "subvol/fit/features/polyline.h"

#include <algorithm>
#include <cstddef>
#include <span>
#include <utility>

namespace subvol::internal {

namespace {

/// Tells where paths end and why curves have none.
class PathsAtCorners {
 public:
  PathsAtCorners(const RoutingTask& task, const CornerPlacement& corners, std::span<const Index> possible)
      : task_(task), corners_(corners), possible_(possible) {}

  /// Records the corner at one end of a path. Returns false if the path ends elsewhere.
  bool note_corner(Index c, int end, std::span<const Index> path, std::vector<PlacedCorner>& noted) const {
    const Index corner = task_.corner_of(c, end), v = end == 0 ? path.front() : path.back();
    const bool ends_there = corners_.vertex_of(corner) == v;
    if (task_.features().curves.is_corner(corner) && ends_there) noted.push_back({corner, v});
    return task_.curves()[c].closed() || ends_there;
  }

  UnfollowedCurve explained(Index c) const {
    const FeatureCurve& curve = task_.curves()[c];
    const ArcLength arc(curve.points);
    const Vec3 middle = arc.at(arc.length() / 2);
    const double h = task_.graph().edge_length();
    const auto because = [&](NotFollowed reason, const Vec3& place) {
      return UnfollowedCurve{c, reason, place, curve.points, arc.length()};
    };
    if (!task_.is_eligible(c)) return because(*task_.reason_against(c), middle);
    for (int end = 0; end < 2 && !curve.closed() && curve.length() >= h; ++end)
      if (corners_.vertex_of(task_.corner_of(c, end)) == kNoIndex)
        return because(NotFollowed::no_vertex_at_corner, end == 0 ? curve.points.front() : curve.points.back());
    if (curve.length() < h) return because(NotFollowed::shorter_than_cell, middle);
    if (!std::ranges::binary_search(possible_, c)) return because(NotFollowed::no_path_nearby, middle);
    for (int end = 0; end < 2; ++end)
      if (has_too_few_edges(task_.corner_of(c, end)))
        return because(NotFollowed::too_many_edges_at_corner, end == 0 ? curve.points.front() : curve.points.back());
    return because(NotFollowed::lost_to_neighbor, middle);
  }

 private:
  bool has_too_few_edges(Index corner) const {
    const FeatureCurves& curves = task_.features().curves;
    const Index v = corners_.vertex_of(corner);
    const auto at = std::ranges::lower_bound(curves.corners, corner);
    if (v == kNoIndex || at == curves.corners.end() || *at != corner) return false;
    return std::ssize(task_.graph().edges_at(v)) < curves.corner_edges[at - curves.corners.begin()];
  }

  const RoutingTask& task_;
  const CornerPlacement& corners_;
  std::span<const Index> possible_;  ///< `PathsOfCurves::possible`
};

/// Returns what the paths along parts of a curve leave out. lost: the whole curve.
UnfollowedCurve left_out_by_parts(UnfollowedCurve lost, const FeatureCurve& curve, std::span<const PartPath> parts) {
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
    leave_out(parts.back().part.to - (wrapped > 0 ? length : 0), parts.front().part.from + (wrapped > 0 ? 0 : length));
  else
    leave_out(parts.back().part.to, length);
  if (lost.points.empty()) return lost;
  const ArcLength arc(lost.points);
  lost.place = arc.at(arc.length() / 2);
  return lost;
}

}  // namespace

FeatureRouting routing_result(const RoutingTask& task, const CornerPlacement& corners, const PathsOfCurves& paths) {
  const PathsAtCorners at_corners(task, corners, paths.possible);
  FeatureRouting routing;
  for (std::size_t i = 0; i < task.curves().size(); ++i) {
    const auto c = static_cast<Index>(i);
    const std::vector<Index>& whole = paths.whole[c];
    const auto parts = paths.parts.find(c);
    if (parts != paths.parts.end() && !parts->second.empty()) {
      for (const auto& [part, path] : parts->second) {
        routing.paths.push_back({c, path});
        routing.parts.push_back(part);
        for (int end = 0; end < 2; ++end) at_corners.note_corner(c, end, path, routing.corners);
      }
      UnfollowedCurve lost = left_out_by_parts(at_corners.explained(c), task.curves()[c], parts->second);
      if (lost.length > 0) routing.unfollowed.push_back(std::move(lost));
    } else if (whole.empty()) {
      routing.unfollowed.push_back(at_corners.explained(c));
    } else {
      routing.paths.push_back({c, whole});
      const bool front = at_corners.note_corner(c, 0, whole, routing.corners);
      const bool back = at_corners.note_corner(c, 1, whole, routing.corners);
      if (!front || !back) routing.joined.push_back(c);
    }
  }
  std::ranges::sort(routing.corners, {}, [](const PlacedCorner& p) { return std::pair(p.vertex, p.corner); });
  routing.corners.erase(std::unique(routing.corners.begin(), routing.corners.end()), routing.corners.end());
  return routing;
}

}  // namespace subvol::internal
