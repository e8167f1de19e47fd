// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/features/crease_distance.h"

#include "subvol/base/error.h"
#include "subvol/fit/features/polyline.h"
#include "subvol/fit/geometry/closest_point.h"

#include <cmath>
#include <optional>
#include <string>

namespace subvol {

using namespace internal;

namespace {

/// Divides a segment into at most 1e5 equal parts, no longer than `spacing` otherwise; calls visit(midpoint, length).
template <class Visit>
void sample_segment(const Vec3& a, const Vec3& b, double spacing, const Visit& visit) {
  constexpr double kMostSegmentParts = 1e5;
  const double length = (b - a).norm();
  const int parts = static_cast<int>(std::min(kMostSegmentParts, std::max(1.0, std::ceil(length / spacing))));
  for (int k = 0; k < parts; ++k) visit(Vec3(a + (b - a) * ((k + 0.5) / parts)), length / parts);
}

/// Mean over length and maximum of distances.
struct Sum {
  double length = 0, total = 0, max = 0;
  Vec3 farthest = Vec3::Zero();
  void add(const Vec3& p, double distance, double weight) {
    length += weight;
    total += weight * distance;
    if (distance > max) max = distance, farthest = p;
  }
  double mean() const { return length > 0 ? total / length : 0; }
};

template <class Visit>
void sample_polyline(std::span<const Vec3> points, double spacing, const Visit& visit) {
  for (std::size_t i = 0; i + 1 < points.size(); ++i) sample_segment(points[i], points[i + 1], spacing, visit);
}

std::optional<ClosestPoint> crease_tree(std::span<const Vec3> points, std::span<const CreaseSegment> segments) {
  if (segments.empty()) return std::nullopt;
  TriangleMesh mesh;
  for (const CreaseSegment& s : segments) {
    const auto first = static_cast<Index>(mesh.positions.size());
    for (Index end : s.ends) mesh.positions.push_back(points[end]);
    mesh.triangles.push_back({first, first + 1, first + 1});
  }
  return ClosestPoint(mesh);
}

void check_segments(std::span<const CreaseSegment> segments, std::size_t num_points, std::size_t num_curves) {
  for (const CreaseSegment& s : segments) {
    for (Index end : s.ends)
      if (end < 0 || static_cast<std::size_t>(end) >= num_points)
        throw InputError("crease_distance: a segment names point " + std::to_string(end));
    if (s.curve != kNoIndex && (s.curve < 0 || static_cast<std::size_t>(s.curve) >= num_curves))
      throw InputError("crease_distance: a segment names curve " + std::to_string(s.curve));
  }
}

}  // namespace

CreaseDistance crease_distance(const FeatureCurves& curves, std::span<const Vec3> points,
                               std::span<const CreaseSegment> segments, double diagonal,
                               const FeatureCurves* followed) {
  if (!(diagonal > 0)) throw InputError("crease_distance: diagonal must be positive");
  const std::vector<FeatureCurve>& parts = followed ? followed->curves : curves.curves;
  check_segments(segments, points.size(), parts.size());
  const double spacing = diagonal / 1000, percent = 100 / diagonal;
  std::vector<std::vector<CreaseSegment>> by_curve(parts.size());
  CreaseDistance result;
  for (const CreaseSegment& s : segments) {
    result.crease_length_percent += percent * (points[s.ends[1]] - points[s.ends[0]]).norm();
    if (s.curve != kNoIndex) by_curve[s.curve].push_back(s);
  }
  const std::optional<ClosestPoint> any = crease_tree(points, segments);
  Sum from_target, to_target;
  double within = 0;
  result.num_curves = curves.curves.size();
  for (const FeatureCurve& curve : curves.curves) {
    result.target_length_percent += percent * curve.length();
    sample_polyline(curve.points, spacing, [&](const Vec3& y, double length) {
      if (any && any->closest(y).distance * percent <= kSharpPercent) within += length;
    });
  }
  for (std::size_t c = 0; c < parts.size(); ++c) {
    const std::optional<ClosestPoint> own = crease_tree(points, by_curve[c]);
    if (!own) continue;
    if (c < curves.curves.size()) ++result.num_followed;
    result.followed_length_percent += percent * parts[c].length();
    sample_polyline(parts[c].points, spacing,
                    [&](const Vec3& y, double length) { from_target.add(y, own->closest(y).distance, length); });
    const ClosestPoint tree = polyline_tree(parts[c].points);
    for (const CreaseSegment& s : by_curve[c])
      sample_segment(points[s.ends[0]], points[s.ends[1]], spacing,
                     [&](const Vec3& x, double length) { to_target.add(x, tree.closest(x).distance, length); });
  }
  result.mean_from_target_percent = percent * from_target.mean();
  result.max_from_target_percent = percent * from_target.max;
  result.mean_to_target_percent = percent * to_target.mean();
  result.max_to_target_percent = percent * to_target.max;
  result.farthest = from_target.max >= to_target.max ? from_target.farthest : to_target.farthest;
  result.within_length_percent = percent * within;
  return result;
}

}  // namespace subvol
