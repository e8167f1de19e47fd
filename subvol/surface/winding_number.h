// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface/triangle_mesh.h"

#include <span>
#include <vector>

namespace subvol {

/// Generalised winding numbers of triangles: how much of the sphere around a point they cover, by the side they show.
///
///   w(x) = 1/(4 pi) sum over triangles of the signed solid angle seen from x
///
/// 1 inside a closed surface whose normals point outward, 0 outside, in between where there are holes; soups and
/// overlaps are welcome. Solid angles after Van Oosterom and Strackee (1983); triangles far away count together by
/// their area vectors and first moments, as in Barill, Dickson, Schmidt, Levin and Jacobson, "Fast winding numbers"
/// (2018).
class WindingNumber {
 public:
  /// InputError: no triangles, a vertex number out of range, a position that is not finite.
  explicit WindingNumber(const TriangleMesh& mesh);

  /// w(p), within about 0.01 of the sum over all triangles. On the surface the value is that of either side, or
  /// between. Safe from many threads at once. Cost: logarithmic for points away from the surface.
  double at(const Vec3& p) const;

  /// `at` for many points, in parallel; the same bits for any number of threads.
  std::vector<double> at(std::span<const Vec3> points) const;

 private:
  struct Node {
    Vec3 centre;           ///< of area
    double radius = 0;     ///< of a ball around it that holds the triangles
    Vec3 area_vector;
    Mat3 moment;           ///< sum of (centroid - centre) area_vector^T
    Index begin = 0, end = 0;      ///< triangles
    Index left = kNoIndex, right = kNoIndex;
  };
  Index build(std::vector<Index>& order, Index begin, Index end);

  std::vector<std::array<Vec3, 3>> corners_, unsorted_;
  std::vector<Node> nodes_;
};

}  // namespace subvol
