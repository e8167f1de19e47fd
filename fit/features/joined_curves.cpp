// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/features/joined_curves.h"

#include "subvol/fit/features/polyline.h"
#include "subvol/fit/geometry/closest_point.h"

#include <algorithm>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace subvol::internal {

namespace {

/// The path of a curve that another path joins.
struct Junction {
  Index curve;
  bool at_front;  ///< nearer to the path's first vertex than to its last
};

std::optional<Junction> junction_at(const FeatureRouting& routing, Index joined, Index vertex) {
  for (const CreasePath& path : routing.paths) {
    if (path.curve == joined) continue;
    const auto at = std::ranges::find(path.vertices, vertex);
    if (at == path.vertices.begin() || at == path.vertices.end()) continue;
    if (at + 1 == path.vertices.end()) continue;  // another path that joins there
    // A path joins another one in the first half, seen from their corner.
    return Junction{path.curve, 2 * (at - path.vertices.begin()) < std::ssize(path.vertices)};
  }
  return std::nullopt;
}

/// Lets a curve begin where another one is closest to the vertex at which its path joins that one's, with a line to the
/// place on itself that is as far from their corner.
void start_at_junction(FeatureCurve& curve, const FeatureCurve& other, bool at_front, const Vec3& vertex) {
  const ArcLength arc(other.points), own(curve.points);
  std::vector<Vec3> half = at_front ? arc.part(0, arc.length() / 2) : arc.part(arc.length() / 2, arc.length());
  if (!at_front) std::reverse(half.begin(), half.end());
  const ClosestPoint::Hit junction = polyline_tree(half).closest(vertex);
  const auto first = static_cast<std::size_t>(junction.triangle);
  const double before = polyline_length(std::span(half).first(first + 1)) + (junction.point - half[first]).norm();
  const double most = 0.5 * own.length();  // the rest must not vanish
  std::vector<Vec3> points = own.part(std::min(before, most), own.length());
  if (junction.point != points.front()) points.insert(points.begin(), junction.point);
  curve.points = std::move(points);
}

}  // namespace

FeatureCurves followed_parts(const VolumeMesh& mesh, const SignedFeatures& features, const FeatureRouting& routing) {
  FeatureCurves result = features.curves;
  // Only the ends' numbers of vertices still matter: they tell open curves from closed ones.
  const auto number_vertices = [](FeatureCurve& curve) {
    const Index last = curve.vertices.back();
    curve.vertices.resize(curve.points.size(), last);
    curve.vertices.back() = last;
  };
  for (std::size_t i = 0; i < routing.parts.size(); ++i) {
    const FollowedPart& part = routing.parts[i];
    const FeatureCurve& whole = features.curves.curves[part.curve];
    FeatureCurve curve{whole.vertices, points_between(whole, part.from, part.to)};
    if (curve.closed()) curve.vertices.pop_back();  // the part is open
    number_vertices(curve);
    if (i > 0 && routing.parts[i - 1].curve == part.curve)
      result.curves.push_back(std::move(curve));
    else
      result.curves[part.curve] = std::move(curve);
  }
  for (Index c : routing.joined) {
    const auto path = std::ranges::lower_bound(routing.paths, c, {}, &CreasePath::curve);
    FeatureCurve& curve = result.curves[c];
    for (int end = 0; end < 2; ++end) {
      const Index vertex = end == 0 ? path->vertices.front() : path->vertices.back();
      const Index corner = end == 0 ? curve.vertices.front() : curve.vertices.back();
      const bool at_corner = std::ranges::find(routing.corners, PlacedCorner{corner, vertex}) != routing.corners.end();
      const auto junction = at_corner ? std::nullopt : junction_at(routing, c, vertex);
      if (!junction) continue;
      if (end == 1) std::reverse(curve.points.begin(), curve.points.end());
      start_at_junction(curve, features.curves.curves[junction->curve], junction->at_front, mesh.positions[vertex]);
      if (end == 1) std::reverse(curve.points.begin(), curve.points.end());
    }
    number_vertices(curve);
  }
  return result;
}

std::vector<CreasePath> paths_of_parts(std::vector<CreasePath> paths, std::size_t num_curves) {
  auto next = static_cast<Index>(num_curves);
  Index before = kNoIndex;
  for (CreasePath& path : paths)
    if (path.curve == std::exchange(before, path.curve)) path.curve = next++;
  return paths;
}

}  // namespace subvol::internal
