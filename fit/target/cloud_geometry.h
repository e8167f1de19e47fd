// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"

#include <span>
#include <vector>

namespace subvol::internal {

/// Properties of a surface, estimated from the points of a cloud that lie on it.
struct CloudGeometry {
  std::vector<Vec3> normals;  ///< unit, of either sign: the direction in which a point's neighborhood is thinnest
  std::vector<double> areas;  ///< area of the surface that each point represents, >= 0
  double area = 0;            ///< their sum, > 0
  double spacing = 0;         ///< sqrt(area / number of points), > 0
};

/// Estimates these properties from the k = min(16, n - 1) nearest neighbors of every point:
///
///   area_i = pi r_i^2 / k,   r_i: distance of the k-th neighbor;   normal_i: least eigenvector of their covariance
///
/// On average, this is the area per point if points are scattered at random with a density that changes slowly. If the
/// cloud is thicker (by noise) than its points are apart, areas come out too small and normals are uncertain.
///
/// InputError: fewer than two points, positions that are not finite, all points in one place, an extent that
/// `require_length` refuses, or groups of coinciding points without area between them. Runs in parallel, with the same
/// bits for any number of threads. Cost: about 5 microseconds a point on one core.
CloudGeometry cloud_geometry(std::span<const Vec3> points);

}  // namespace subvol::internal
