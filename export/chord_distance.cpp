// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/export/chord_distance.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>

namespace subvol::internal {
namespace {

constexpr double kNeighborReach = 0.25;  // relative to the triangle's size; farther out the neighbor may bend away

double segment_distance2(const Vec3& p, const Vec3& a, const Vec3& b) {
  const Vec3 ab = b - a;
  const double length2 = ab.squaredNorm();
  const double t = length2 > 0 ? std::clamp((p - a).dot(ab) / length2, 0.0, 1.0) : 0.0;
  return (p - a - t * ab).squaredNorm();
}

/// A triangle prepared for many distance queries; edge k runs from corner k to corner k + 1.
class Triangle {
 public:
  Triangle(const Vec3& a, const Vec3& b, const Vec3& c, int hard_edge)
      : corners_{a, b, c}, area_((b - a).cross(c - a)) {
    const double area2 = area_.squaredNorm();
    flat_ = !(area2 > 0);
    if (!flat_) area_ /= std::sqrt(area2);
    const double size = std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()});
    for (int k = 0; k < 3; ++k) {
      inward_[k] = area_.cross(corners_[(k + 1) % 3] - corners_[k]).normalized();
      reach_[k] = k == hard_edge ? 0 : kNeighborReach * size;
    }
  }

  double distance2(const Vec3& p) const {
    if (!flat_ && is_covered(p)) {
      const double height = (p - corners_[0]).dot(area_);
      return height * height;
    }
    double least = segment_distance2(p, corners_[2], corners_[0]);
    for (int k = 0; k < 2; ++k) least = std::min(least, segment_distance2(p, corners_[k], corners_[k + 1]));
    return least;
  }

 private:
  /// True if p projects into the triangle or into the part of a neighbor that counts as covered.
  bool is_covered(const Vec3& p) const {
    for (int k = 0; k < 3; ++k)
      if ((p - corners_[k]).dot(inward_[k]) < -reach_[k]) return false;
    return true;
  }

  std::array<Vec3, 3> corners_, inward_;
  Vec3 area_;
  std::array<double, 3> reach_;
  bool flat_;
};

}  // namespace

double chord_distance(const CellSamples& samples, const ChordQuery& query) {
  const auto& steps = query.steps;
  double largest = 0;
  for (int j0 = 0; j0 < kCellSteps; j0 += steps[1])
    for (int i0 = 0; i0 < kCellSteps; i0 += steps[0]) {
      const int i1 = i0 + steps[0], j1 = j0 + steps[1];
      const Vec3 &a = samples.at(i0, j0), &c = samples.at(i1, j1);
      const Triangle lower(a, samples.at(i1, j0), c, query.hard_sides[0] && j0 == 0 ? 0 : -1);
      const Triangle upper(a, c, samples.at(i0, j1), query.hard_sides[1] && i0 == 0 ? 2 : -1);
      for (int j = j0; j <= j1; ++j)
        for (int i = i0; i <= i1; ++i) {
          if ((i == i0 || i == i1) && (j == j0 || j == j1)) continue;
          const bool below = (i - i0) * steps[1] >= (j - j0) * steps[0];
          largest = std::max(largest, (below ? lower : upper).distance2(samples.at(i, j)));
        }
    }
  return std::sqrt(largest);
}

}  // namespace subvol::internal
