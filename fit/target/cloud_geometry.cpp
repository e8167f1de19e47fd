// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/target/cloud_geometry.h"

#include "subvol/base/error.h"
#include "subvol/base/length_range.h"
#include "subvol/fit/geometry/site_tree.h"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace subvol::internal {

namespace {

constexpr std::size_t kNeighbors = 16;  // of a point, for its normal and its area (docs/fitting.md)
// Floor of a squared search radius, as a share of diagonal^2 (k + 1) / n
constexpr double kLeastSquaredRadiusShare = 1e-20;

/// A point of the tree with its distance from the query point.
struct Neighbor {
  double squared_distance;
  Index place;
  auto operator<=>(const Neighbor&) const = default;
};

/// Finds the k nearest of the other points, nearest first; k is at most their number.
class NeighborSearch {
 public:
  NeighborSearch(const SiteTree& tree, std::size_t k, double least) : tree_(tree), k_(k), least_(least) {}

  /// squared_radius  in: a guess of their squared distance, >= least. The result does not depend on it, but a much too
  ///                 large one looks at too many points. out: a good guess for points nearby, >= least > 0 even if
  ///                 points coincide.
  const std::vector<Neighbor>& operator()(Index place, double& squared_radius) {
    const Vec3& center = tree_.position(place);
    for (;; squared_radius *= 4) {
      places_.clear();
      const SiteTree::Ball ball{center, squared_radius};
      tree_.gather({&ball, 1}, tree_.num_sites(), places_);
      if (places_.size() <= k_) continue;
      found_.clear();
      for (Index other : places_)
        if (other != place) found_.push_back({(tree_.position(other) - center).squaredNorm(), other});
      std::partial_sort(found_.begin(), found_.begin() + static_cast<std::ptrdiff_t>(k_), found_.end());
      found_.resize(k_);
      // The tree sums squared distances in another order.
      if (found_.back().squared_distance * kSquaredDistanceSlack <= squared_radius) break;
    }
    squared_radius = std::max({2 * found_.back().squared_distance, 1e-12 * squared_radius, least_});
    return found_;
  }

 private:
  const SiteTree& tree_;
  std::size_t k_;
  double least_;
  std::vector<Index> places_;
  std::vector<Neighbor> found_;
};

/// Returns the direction in which a point and its neighbors are thinnest.
Vec3 thin_direction(const SiteTree& tree, Index place, std::span<const Neighbor> neighbors) {
  Vec3 mean = tree.position(place);
  for (const Neighbor& n : neighbors) mean += tree.position(n.place);
  mean /= static_cast<double>(neighbors.size() + 1);
  const auto square = [&](Index p) -> Mat3 {
    const Vec3 d = tree.position(p) - mean;
    return d * d.transpose();
  };
  Mat3 covariance = square(place);
  for (const Neighbor& n : neighbors) covariance += square(n.place);
  const double size = covariance.trace();
  if (!(size > 0)) return Vec3::UnitX();
  return Eigen::SelfAdjointEigenSolver<Mat3>(covariance / size).eigenvectors().col(0).normalized();
}

}  // namespace

CloudGeometry cloud_geometry(std::span<const Vec3> points) {
  if (points.size() < 2) throw InputError("point cloud: at least two points are needed");
  Vec3 low = points[0], high = points[0];
  for (const Vec3& p : points) {
    if (!p.allFinite()) throw InputError("point cloud: a position is not finite");
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  if (low == high) throw InputError("point cloud: all points are in one place");
  require_length((high - low).maxCoeff(), "point cloud");
  const SiteTree tree(points);
  const std::size_t n = points.size(), k = std::min(kNeighbors, n - 1);
  CloudGeometry result;
  result.normals.resize(n);
  result.areas.resize(n);
  constexpr std::size_t kCloudPointsPerRun = 256;  // radii are passed on within a run, whatever thread takes it
  const double least =
      kLeastSquaredRadiusShare * (high - low).squaredNorm() * static_cast<double>(k + 1) / static_cast<double>(n);
#pragma omp parallel for schedule(dynamic)
  for (std::size_t run = 0; run < (n + kCloudPointsPerRun - 1) / kCloudPointsPerRun; ++run) {
    NeighborSearch neighbors(tree, k, least);
    // Points next to each other in the tree are close in space. The bounding box gives no good guess: one point far
    // away would put the whole cloud within reach.
    const std::size_t first = run * kCloudPointsPerRun, beside = first + 1 < n ? first + 1 : first - 1;
    double squared_radius = std::max(
        least, (tree.position(static_cast<Index>(beside)) - tree.position(static_cast<Index>(first))).squaredNorm());
    for (std::size_t i = first; i < std::min(n, first + kCloudPointsPerRun); ++i) {
      const auto place = static_cast<Index>(i);
      const std::vector<Neighbor>& found = neighbors(place, squared_radius);
      const auto point = static_cast<std::size_t>(tree.site(place));
      result.areas[point] = std::numbers::pi * found.back().squared_distance / static_cast<double>(k);
      result.normals[point] = thin_direction(tree, place, found);
    }
  }
  for (double a : result.areas) result.area += a;
  if (!(result.area > 0)) throw InputError("point cloud: its points lie on each other in groups, with no area between");
  result.spacing = std::sqrt(result.area / static_cast<double>(n));
  return result;
}

}  // namespace subvol::internal
