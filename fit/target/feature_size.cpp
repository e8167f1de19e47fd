// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/target/feature_size.h"

#include "subvol/base/error.h"
#include "subvol/fit/geometry/closest_point.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace subvol {

namespace {

/// Returns the radius of the ball at p on the side of n; `most` if it touches nothing that is about opposite to p.
double ball_radius(const Vec3& p, const Vec3& n, const ClosestPoint& tree, double most) {
  constexpr double kMostOppositeCosine = -0.866;  // cosine of 150 degrees
  constexpr double kEmptyRadiusShare = 0.98;  // a ball is empty if the surface is farther than this share of its radius
  constexpr int kMostBallShrinkings = 30;     // the radius falls in each, and rounding must not keep it falling
  double radius = most, cosine = 1;
  for (int round = 0; round < kMostBallShrinkings; ++round) {
    const Vec3 center = p + radius * n;
    const ClosestPoint::Hit hit = tree.closest_within(center, kEmptyRadiusShare * radius);
    if (hit.triangle == kNoIndex) break;
    const Vec3 across = hit.point - p;
    const double height = across.dot(n), squared = across.squaredNorm();
    if (!(height > 0) || !(squared > 0)) break;  // only rounding puts a point of a smaller ball beside it
    radius = squared / (2 * height);
    cosine = -n.dot(hit.point - (p + radius * n)) / radius;
  }
  return cosine < kMostOppositeCosine ? radius : most;
}

}  // namespace

FeatureSizes feature_sizes(const TargetSurface& surface, const ClosestPoint& tree, double least, double most,
                           const std::function<bool()>& cancelled) {
  constexpr std::size_t kSamplesPerCancelCheck = 4096;
  if (!(least >= 0) || !(most > least) || !std::isfinite(most))
    throw InputError("feature sizes: the largest radius must be finite and above the smallest, which must be >= 0");
  FeatureSizes features;
  if (surface.is_cloud()) return features;
  const std::vector<Vec3>&samples = surface.samples(), &normals = surface.sample_normals();
  std::vector<double> sizes(samples.size(), most);
  for (std::size_t first = 0; first < samples.size(); first += kSamplesPerCancelCheck) {
    if (cancelled && cancelled()) break;
#pragma omp parallel for schedule(dynamic, 64)
    for (std::size_t i = first; i < std::min(first + kSamplesPerCancelCheck, samples.size()); ++i)
      sizes[i] =
          std::min(ball_radius(samples[i], normals[i], tree, most), ball_radius(samples[i], -normals[i], tree, most));
  }
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (sizes[i] < least || sizes[i] >= most) continue;
    features.points.push_back(samples[i]);
    features.sizes.push_back(sizes[i]);
  }
  return features;
}

std::vector<double> feature_distances(const FeatureSizes& features, const ClosestPoint& fitted) {
  std::vector<ClosestPoint::Hit> hits(features.points.size());
  fitted.closest(features.points, hits);
  std::vector<double> distances;
  distances.reserve(hits.size());
  for (const ClosestPoint::Hit& hit : hits) distances.push_back(hit.distance);
  return distances;
}

std::optional<FeatureMiss> largest_feature_miss(const FeatureSizes& features, std::span<const double> distances,
                                                double least_size) {
  std::optional<FeatureMiss> largest;
  for (std::size_t i = 0; i < distances.size(); ++i) {
    const double size = features.sizes[i], share = distances[i] / size;
    if (size >= least_size && (!largest || share > largest->share))
      largest = {share, distances[i], size, features.points[i]};
  }
  return largest;
}

}  // namespace subvol
