// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/features/joined_curves.h"

#include "subvol/fit/features/polyline.h"

#include <algorithm>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace subvol::internal {

namespace {

/// A path that another one joins, and how far from the corner, as a share of its length.
struct Junction {
  Index curve;
  bool at_front;
  double share;
};

std::optional<Junction> junction_at(const VolumeMesh& mesh, const FeatureRouting& routing, Index joined, Index vertex) {
  for (const CreasePath& path : routing.paths) {
    if (path.curve == joined) continue;
    const auto at = std::ranges::find(path.vertices, vertex);
    if (at == path.vertices.begin() || at == path.vertices.end()) continue;
    if (at + 1 == path.vertices.end()) continue;  // another path that joins there
    std::vector<Vec3> points;
    for (Index v : path.vertices) points.push_back(mesh.positions[v]);
    const double length = polyline_length(points);
    const double before = polyline_length(std::span(points).first(at - path.vertices.begin() + 1));
    // A path joins another one in the first half, seen from their corner.
    const bool at_front = 2 * (at - path.vertices.begin()) < std::ssize(path.vertices);
    const double share = length > 0 ? before / length : 0;
    return Junction{path.curve, at_front, at_front ? share : 1 - share};
  }
  return std::nullopt;
}

/// Replaces the beginning of a curve, as far as the junction lies from the corner, by the junction.
void start_at_junction(FeatureCurve& curve, const FeatureCurve& other, const Junction& junction) {
  const ArcLength arc(other.points), own(curve.points);
  const double before = junction.share * arc.length();
  const double most = 0.5 * own.length();  // the rest must not vanish
  std::vector<Vec3> points = own.part(std::min(before, most), own.length());
  points.front() = arc.at(junction.at_front ? before : arc.length() - before);
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
      const auto junction = at_corner ? std::nullopt : junction_at(mesh, routing, c, vertex);
      if (!junction) continue;
      if (end == 1) std::reverse(curve.points.begin(), curve.points.end());
      start_at_junction(curve, features.curves.curves[junction->curve], *junction);
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
