// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/geometry/normal_deviation.h"

#include "subvol/fit/geometry/closest_point.h"
#include "subvol/surface/triangle_geometry.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

namespace subvol {

using namespace internal;

namespace {

constexpr double kBinsPerDegree = 2;  // angles from 0 to 90 degrees
constexpr std::size_t kAngleBins = 180;

/// Areas by angle.
struct Angles {
  std::array<double, kAngleBins> area{};
  double total = 0, integral = 0;

  void add(double degrees, double share) {
    area[std::min(kAngleBins - 1, static_cast<std::size_t>(kBinsPerDegree * degrees))] += share;
    total += share;
    integral += share * degrees;
  }
  void add(const Angles& other) {
    for (std::size_t i = 0; i < kAngleBins; ++i) area[i] += other.area[i];
    total += other.total;
    integral += other.integral;
  }
};

double degrees_between(const Vec3& a, const Vec3& b) {
  return std::atan2(a.cross(b).norm(), std::abs(a.dot(b))) * 180 / std::numbers::pi;
}

}  // namespace

NormalDeviation normal_deviation(const TriangleMesh& fitted, const ClosestPoint& fitted_tree,
                                 const TriangleMesh& target, const ClosestPoint& target_tree, int num_samples) {
  double total = 0;
  for (std::size_t t = 0; t < fitted.triangles.size(); ++t)
    total += doubled_area_vector(fitted, fitted.triangles[t]).norm();
  constexpr std::size_t kTrianglesPerRun = 32;  // sums and hints stay within a run, whatever thread takes it
  std::vector<Angles> runs((fitted.triangles.size() + kTrianglesPerRun - 1) / kTrianglesPerRun);
#pragma omp parallel for schedule(dynamic)
  for (std::size_t run = 0; run < runs.size(); ++run) {
    Index hint = kNoIndex;
    for (std::size_t place = run * kTrianglesPerRun;
         place < std::min((run + 1) * kTrianglesPerRun, fitted.triangles.size()); ++place) {
      const auto t = static_cast<std::size_t>(fitted_tree.order()[place]);  // neighbors in space
      const Vec3 vector = doubled_area_vector(fitted, fitted.triangles[t]);
      const double share = total > 0 ? vector.norm() / total : 0;
      if (!(share > 0)) continue;
      const auto& [ia, ib, ic] = fitted.triangles[t];
      const Vec3 &a = fitted.positions[ia], &b = fitted.positions[ib], &c = fitted.positions[ic];
      const int m = std::max(1, static_cast<int>(std::lround(std::sqrt(num_samples * share))));
      const auto compare = [&](double u, double v) {
        const ClosestPoint::Hit hit = target_tree.closest(a + u / m * (b - a) + v / m * (c - a), hint);
        hint = hit.triangle;
        const Vec3 other = doubled_area_vector(target, target.triangles[hit.triangle]);
        if (other.squaredNorm() > 0) runs[run].add(degrees_between(vector, other), share / (m * m));
      };
      for (int i = 0; i < m; ++i)
        for (int j = 0; i + j < m; ++j) {
          compare(i + 1 / 3.0, j + 1 / 3.0);
          if (i + j + 1 < m) compare(i + 2 / 3.0, j + 2 / 3.0);
        }
    }
  }
  Angles all;
  for (const Angles& run : runs) all.add(run);
  if (!(all.total > 0)) return {};
  double below = 0;
  std::size_t bin = 0;
  while (bin < kAngleBins && (below += all.area[bin]) < 0.95 * all.total) ++bin;
  return {all.integral / all.total, static_cast<double>(std::min(bin + 1, kAngleBins)) / kBinsPerDegree};
}

}  // namespace subvol
