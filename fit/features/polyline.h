// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"
#include "subvol/fit/geometry/closest_point.h"

#include <span>
#include <vector>

namespace subvol::internal {

/// Returns the length of a polyline. All functions expect polylines of at least two points.
double polyline_length(std::span<const Vec3> points);

/// Returns a tree over the segments of a polyline, numbered in its order. points: finite.
ClosestPoint polyline_tree(std::span<const Vec3> points);

/// Returns points along a polyline, its vertices among them, at most `spacing` apart; farther if these would be more
/// than about 1e5. spacing >= 0.
std::vector<Vec3> sampled_polyline(std::span<const Vec3> points, double spacing);

/// Returns the largest distance of some points from a surface or polyline; 0 without points.
double farthest(std::span<const Vec3> points, const ClosestPoint& tree);

/// A polyline by its arc length. The points must outlive it.
class ArcLength {
 public:
  explicit ArcLength(std::span<const Vec3> points);
  double length() const { return along_.back(); }
  /// Returns the point at a place in [0, length]; others are cut off.
  Vec3 at(double place) const;
  /// Returns the part between two places, 0 <= from <= to <= length, with the vertices between them.
  std::vector<Vec3> part(double from, double to) const;

 private:
  std::size_t segment(double place) const;

  std::span<const Vec3> points_;
  std::vector<double> along_;  ///< arc length up to each point
};

}  // namespace subvol::internal
