// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface/triangle_mesh.h"

#include <array>
#include <span>
#include <vector>

namespace subvol::internal {

/// Generalized winding numbers of triangles: the signed share of the sphere around a point that they cover.
///
///   w(x) = 1/(4 pi) sum over triangles of the signed solid angle seen from x
///
/// w is 1 inside a closed surface whose normals point outward, 0 outside it, and in between if there are holes; soups
/// and overlaps are welcome. Solid angles follow Van Oosterom and Strackee (1983); far triangles are summed in groups
/// by their area vectors and their first and second moments, as in Barill, Dickson, Schmidt, Levin and Jacobson, "Fast
/// winding numbers" (2018).
class WindingNumber {
 public:
  /// InputError: no triangles, a vertex number out of range, a position that is not finite.
  explicit WindingNumber(const TriangleMesh& mesh);

  /// Returns w(p), within about 0.01 of the sum over all triangles. On the surface the value is that of either side, or
  /// between the two. May be called from several threads. Cost: logarithmic for points away from the surface.
  double at(const Vec3& p) const;

  /// Evaluates `at` for many points in parallel; the result has the same bits for any number of threads.
  std::vector<double> at(std::span<const Vec3> points) const;

 private:
  /// Holds the integral of (x - c)(x - c)^T n over the triangles, with center c and normals n, as far as the winding
  /// number depends on it.
  struct SecondMoments {
    Vec3 linear = Vec3::Zero();
    std::array<double, 10> cubic{};  ///< coefficients of xxx, xxy, xxz, xyy, xyz, xzz, yyy, yyz, yzz, zzz

    void add(const Vec3& offset, const Vec3& area_vector);
    double at(const Vec3& r) const;
  };
  struct Node {
    Vec3 center;        ///< center of area
    double radius = 0;  ///< radius of the ball around the center that contains the triangles
    Vec3 area_vector;   ///< sum over the triangles
    Mat3 moment;        ///< sum of (centroid - center) area_vector^T
    SecondMoments second;
    Index begin = 0, end = 0;  ///< range of the triangles
    Index left = kNoIndex, right = kNoIndex;
  };
  Index build(std::vector<Index>& order, Index begin, Index end);

  std::vector<std::array<Vec3, 3>> corners_, unsorted_;
  std::vector<Node> nodes_;
};

}  // namespace subvol::internal
