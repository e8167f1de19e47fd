// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface/point_cloud.h"
#include "subvol/surface/triangle_mesh.h"

#include <algorithm>
#include <span>

namespace subvol {

class ClosestPoint;

/// Options of `surface_distance`.
struct SurfaceDistanceOptions {
  int num_samples = 50000;  ///< approximate number of points of each mean, spread by area; >= 1
  /// Vertices and points on edges also count for the maxima. Without them, measuring takes about two thirds of the
  /// time.
  bool extremes = true;
};

/// Distances between two surfaces, both ways, in the mesh's unit.
struct SurfaceDistance {
  struct Extreme {
    double distance = 0;
    Vec3 from{0, 0, 0}, to{0, 0, 0};  ///< the point and its closest point on the other surface
  };
  double mean_a_to_b = 0, mean_b_to_a = 0;
  Extreme max_a_to_b, max_b_to_a;
  /// True if b is a point cloud: there is no distance from a to what lies between its points, and only the distances
  /// from b to a are set.
  bool one_sided = false;

  /// Return the symmetric distances: the larger of the two one-sided ones, or the only one.
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
/// centroids have equal weights in its part of the mean. Vertices and midpoints of edges also count for the maximum,
/// once each (`extremes`), and on edges of more than 10 degrees or of one triangle as many points as their length asks
/// for. If there are more than four times as many triangles as num_samples, those of less than an eighth of a sample's
/// area are sampled at their corners only, each of which has the weight of a third of the area. The maximum is a lower
/// bound of the true one; it is off by less than the distance between samples. Triangles without area have no weight.
///
/// InputError: as `ClosestPoint` for either surface; num_samples < 1. Deterministic and parallel, with the same bits
/// for any number of threads. Cost: about 0.4 us a sample on one core, plus both trees.
SurfaceDistance surface_distance(const TriangleMesh& a, const TriangleMesh& b,
                                 const SurfaceDistanceOptions& options = {});

/// Does the same with existing trees, for a target that is measured against many times.
SurfaceDistance surface_distance(const TriangleMesh& a, const ClosestPoint& tree_a, const TriangleMesh& b,
                                 const ClosestPoint& tree_b, const SurfaceDistanceOptions& options = {});

/// Measures the distances from points to a surface, all with the same weight; the result is one-sided.
///
/// InputError: as `ClosestPoint`, or no points. Same bits for any number of threads.
SurfaceDistance surface_distance(const TriangleMesh& a, const PointCloud& b);
SurfaceDistance surface_distance(const ClosestPoint& tree_a, std::span<const Vec3> b);

/// Returns the diagonal of the bounding box of a surface's triangles, to which percentages of distances refer; 0 if
/// there are none.
double bounding_box_diagonal(const TriangleMesh& mesh);
/// Returns the diagonal of the bounding box of the points; 0 if there are none.
double bounding_box_diagonal(const PointCloud& cloud);

}  // namespace subvol
