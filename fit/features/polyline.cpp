// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/features/polyline.h"

#include "subvol/fit/geometry/closest_point.h"

#include <algorithm>
#include <cmath>

namespace subvol::internal {

double polyline_length(std::span<const Vec3> points) {
  double length = 0;
  for (std::size_t i = 0; i + 1 < points.size(); ++i) length += (points[i + 1] - points[i]).norm();
  return length;
}

ClosestPoint polyline_tree(std::span<const Vec3> points) {
  TriangleMesh segments;
  segments.positions.assign(points.begin(), points.end());
  for (Index i = 0; i + 1 < static_cast<Index>(points.size()); ++i) segments.triangles.push_back({i, i + 1, i + 1});
  return ClosestPoint(segments);
}

std::vector<Vec3> sampled_polyline(std::span<const Vec3> points, double spacing) {
  constexpr double kMostPolylineSamples = 1e5;
  const double step = std::max(spacing, polyline_length(points) / kMostPolylineSamples);
  std::vector<Vec3> samples = {points[0]};
  for (std::size_t i = 0; i + 1 < points.size(); ++i) {
    const double length = (points[i + 1] - points[i]).norm();
    const int parts = length > step ? static_cast<int>(std::ceil(length / step)) : 1;
    for (int k = 1; k <= parts; ++k)
      samples.push_back(points[i] + (points[i + 1] - points[i]) * (static_cast<double>(k) / parts));
  }
  return samples;
}

double farthest(std::span<const Vec3> points, const ClosestPoint& tree) {
  double distance = 0;
  for (const Vec3& p : points) distance = std::max(distance, tree.closest(p).distance);
  return distance;
}

ArcLength::ArcLength(std::span<const Vec3> points) : points_(points), along_{0} {
  for (std::size_t i = 1; i < points.size(); ++i) along_.push_back(along_.back() + (points[i] - points[i - 1]).norm());
}

Vec3 ArcLength::at(double place) const {
  const std::size_t i = segment(place);
  const double length = along_[i + 1] - along_[i];
  const double share = length > 0 ? std::clamp((place - along_[i]) / length, 0.0, 1.0) : 0.0;
  return points_[i] + (points_[i + 1] - points_[i]) * share;
}

std::vector<Vec3> ArcLength::part(double from, double to) const {
  std::vector<Vec3> result = {at(from)};
  for (std::size_t i = 0; i < along_.size(); ++i)
    if (along_[i] > from && along_[i] < to) result.push_back(points_[i]);
  result.push_back(at(to));
  return result;
}

std::size_t ArcLength::segment(double place) const {
  const auto above = std::upper_bound(along_.begin(), along_.end(), place) - along_.begin();
  return static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(above - 1, 0, std::ssize(along_) - 2));
}

}  // namespace subvol::internal
