// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/geometry/closest_point.h"
#include "subvol/surface/point_cloud.h"

#include <algorithm>
#include <span>

namespace subvol {

struct SurfaceDistanceOptions {
  int num_samples = 50000;  ///< about so many points carry each mean, spread by area; >= 1
  bool extremes = true;     ///< vertices and edge midpoints are looked at as well, for the maxima
};

/// Distances between two surfaces, both ways, in the mesh's unit.
struct SurfaceDistance {
  struct Extreme {
    double distance = 0;
    Vec3 from{0, 0, 0}, to{0, 0, 0};  ///< the point and its closest point on the other surface
  };
  double mean_a_to_b = 0, mean_b_to_a = 0;
  Extreme max_a_to_b, max_b_to_a;
  /// Whether b is known by points only: there is no way from a to what lies between them, and only the distances from b
  /// to a are set.
  bool one_sided = false;

  /// Symmetric distances: the larger of the two one-sided ones, or the only one.
  double mean() const { return std::max(mean_a_to_b, mean_b_to_a); }
  double max() const { return std::max(max_a_to_b.distance, max_b_to_a.distance); }
  const Extreme& extreme() const {
    return !one_sided && max_a_to_b.distance >= max_b_to_a.distance ? max_a_to_b : max_b_to_a;
  }
};

/// Samples the distance from each surface to the other.
///
///   mean_a_to_b = 1/A integral over a of dist(x, b),   max_a_to_b = max over a of dist(x, b)
///
/// Every triangle is cut into m^2 equal ones, m = sqrt(num_samples * its share of the area) rounded, at least 1; their
/// centroids carry the mean with equal weights. Vertices and edge midpoints count for the maximum as well, once each;
/// it is a lower bound, by less than the distance between samples. Triangles without area weigh nothing.
///
/// InputError: as `ClosestPoint` for either surface; num_samples < 1. Deterministic, parallel, same bits for any number
/// of threads. Cost: about 0.4 us a sample on one core, plus both trees.
SurfaceDistance surface_distance(const TriangleMesh& a, const TriangleMesh& b,
                                 const SurfaceDistanceOptions& options = {});

/// The same with trees built before: for a target that is asked many times.
SurfaceDistance surface_distance(const TriangleMesh& a, const ClosestPoint& tree_a, const TriangleMesh& b,
                                 const ClosestPoint& tree_b, const SurfaceDistanceOptions& options = {});

/// One-sided: the distances from points to a surface, all of the same weight.
///
/// InputError: as `ClosestPoint`; no points. Same bits for any number of threads.
SurfaceDistance surface_distance(const TriangleMesh& a, const PointCloud& b);
SurfaceDistance surface_distance(const ClosestPoint& tree_a, std::span<const Vec3> b);

/// Length of the diagonal of the box around a surface's triangles: what percentages of distances refer to. 0 if empty.
double bounding_box_diagonal(const TriangleMesh& mesh);
/// Of the box around points.
double bounding_box_diagonal(const PointCloud& cloud);

}  // namespace subvol
