// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/geometry/thinnest_place.h"

#include "subvol/surface/triangle_geometry.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace subvol::internal {

namespace {

constexpr std::size_t kThinnessSamples = 20'000;  // points of the surface from which balls grow
constexpr int kMostEdgeParts = 6;                 // into which an edge of a triangle is cut
/// A ball counts as empty if a smaller one is, by this factor. The center of the smaller one is not as far from many
/// triangles as from the closest, as the center of a round solid is: the search stays short.
constexpr double kEmptyBallFactor = 0.75;
constexpr double kCloseLookShare = 0.99;      // share of the best width below which a place is looked at closely
constexpr double kMostCosine = -0.5;          // of the angle between the normals of two stretches that face each other
constexpr double kLeastAcrossCosine = 0.866;  // of the angle between the normal and the line across: 30 degrees

/// A point of a triangle.
struct Sample {
  Index triangle;
  Vec3 point;
};

/// Returns the centers of the parts of evenly spread triangles.
std::vector<Sample> samples_of(const TriangleMesh& mesh) {
  const std::size_t n = mesh.triangles.size();
  if (n == 0) return {};
  const std::size_t wanted = std::min(n, kThinnessSamples);
  const int parts = std::clamp(
      static_cast<int>(std::sqrt(static_cast<double>(kThinnessSamples) / static_cast<double>(n))), 1, kMostEdgeParts);
  std::vector<Sample> samples;
  for (std::size_t i = 0; i < wanted; ++i) {
    const auto t = static_cast<Index>(i * n / wanted);
    const auto& [a, b, c] = mesh.triangles[t];
    const Vec3 &p = mesh.positions[a], u = (mesh.positions[b] - p) / parts, v = (mesh.positions[c] - p) / parts;
    for (int j = 0; j < parts; ++j)
      for (int k = 0; j + k < parts; ++k) {
        samples.push_back({t, p + (j + 1.0 / 3) * u + (k + 1.0 / 3) * v});
        if (j + k + 1 < parts) samples.push_back({t, p + (j + 2.0 / 3) * u + (k + 2.0 / 3) * v});
      }
  }
  return samples;
}

/// Grows balls from samples.
class Balls {
 public:
  Balls(const TriangleMesh& mesh, const ClosestPoint& tree, ThinSide side) : mesh_(mesh), tree_(tree), side_(side) {
    Eigen::AlignedBox3d box;
    for (const auto& t : mesh.triangles)
      for (Index v : t) box.extend(mesh.positions[v]);
    diagonal_ = box.diagonal().norm();
  }

  /// Returns the place where the ball at a sample touches the surface again, if it is narrower than `most`; width 0:
  /// there is none that counts.
  ThinPlace place(const Sample& sample, double most) const {
    const Vec3 front = triangle_normal(mesh_, sample.triangle);
    if (!front.allFinite() || front.isZero()) return {};
    const Vec3 inward = side_ == ThinSide::wall ? Vec3(-front) : front;
    // The line across is within 30 degrees of the normal: the ball is no larger than the width over the root of 3.
    const double radius = std::min(diagonal_, most / std::sqrt(3.0) / kEmptyBallFactor);
    ThinPlace found;
    if (!shrink(sample, inward, radius, found) || !faces(found, inward)) return {};
    return found;
  }

 private:
  /// Shrinks a ball until the surface is outside of `kEmptyBallFactor` times it. Returns false if it never touches the
  /// surface.
  bool shrink(const Sample& sample, const Vec3& inward, double radius, ThinPlace& found) const {
    constexpr int kMostShrinkingSteps = 40;   // of kEmptyBallFactor each: 1e-5 of the first radius
    constexpr double kTouchTolerance = 1e-7;  // share of the radius
    for (int step = 0; step < kMostShrinkingSteps; ++step) {
      const double smaller = kEmptyBallFactor * radius;
      const ClosestPoint::Hit hit = tree_.closest(sample.point + smaller * inward, sample.triangle);
      if (hit.triangle == kNoIndex || hit.distance >= (1 - kTouchTolerance) * smaller) break;
      const Vec3 to = hit.point - sample.point;
      const double depth = inward.dot(to);
      if (!(depth > 0)) return false;
      radius = to.squaredNorm() / (2 * depth);
      found = {to.norm(), sample.point, hit.point, {sample.triangle, hit.triangle}};
    }
    return found.triangles[1] != kNoIndex;
  }
  bool faces(const ThinPlace& place, const Vec3& inward) const {
    for (Index v : mesh_.triangles[place.triangles[0]])
      for (Index w : mesh_.triangles[place.triangles[1]])
        if (v == w) return false;
    const double opposite = triangle_normal(mesh_, place.triangles[0]).dot(triangle_normal(mesh_, place.triangles[1]));
    return opposite <= kMostCosine && inward.dot(place.across - place.at) >= kLeastAcrossCosine * place.width;
  }

  const TriangleMesh& mesh_;
  const ClosestPoint& tree_;
  ThinSide side_;
  double diagonal_ = 0;
};

}  // namespace

std::optional<ThinPlace> thinnest_place(const TriangleMesh& mesh, const ClosestPoint& tree, ThinSide side,
                                        const std::function<bool()>& cancelled) {
  constexpr std::size_t kAtATime = 512;  // samples between two questions whether to go on
  const std::vector<Sample> samples = samples_of(mesh);
  const Balls balls(mesh, tree, side);
  std::vector<ThinPlace> places(samples.size());
  const ThinPlace* best = nullptr;
  for (std::size_t first = 0; first < samples.size(); first += kAtATime) {
    if (cancelled && cancelled()) return std::nullopt;
    const std::size_t end = std::min(first + kAtATime, samples.size());
    const double most = best ? kCloseLookShare * best->width : std::numeric_limits<double>::infinity();
#pragma omp parallel for schedule(dynamic, 64)
    for (std::size_t i = first; i < end; ++i) places[i] = balls.place(samples[i], most);
    for (std::size_t i = first; i < end; ++i)
      if (places[i].width > 0 && (!best || places[i].width < best->width)) best = &places[i];
  }
  if (!best) return std::nullopt;
  return *best;
}

}  // namespace subvol::internal
