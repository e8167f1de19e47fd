// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/geometry/surface_distance.h"

#include "subvol/base/error.h"

#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>

namespace subvol {

namespace {

struct OneSided {
  double mean = 0;
  SurfaceDistance::Extreme max;
};

double area_of(const TriangleMesh& mesh, Index t) {
  const auto& [a, b, c] = mesh.triangles[t];
  return 0.5 * (mesh.positions[b] - mesh.positions[a]).cross(mesh.positions[c] - mesh.positions[a]).norm();
}

/// Returns, per place in `order`, the corners (bits 0-2) and edges (bits 3-5) that no earlier triangle has.
std::vector<std::uint8_t> first_uses(const TriangleMesh& mesh, std::span<const Index> order) {
  std::vector<std::uint8_t> uses(order.size(), 0);
  std::vector<char> seen(mesh.positions.size(), 0);
  struct Edge {
    std::uint64_t key;
    Index place;
    int local;
  };
  std::vector<Edge> edges;
  edges.reserve(3 * order.size());
  for (std::size_t place = 0; place < order.size(); ++place)
    for (int k = 0; k < 3; ++k) {
      const Index v = mesh.triangles[order[place]][k], w = mesh.triangles[order[place]][(k + 1) % 3];
      if (!seen[v]) uses[place] |= 1 << k;
      seen[v] = 1;
      const auto [low, high] = std::minmax(v, w);
      edges.push_back({static_cast<std::uint64_t>(low) << 32 | static_cast<std::uint32_t>(high),
                       static_cast<Index>(place), k});
    }
  std::sort(edges.begin(), edges.end(), [](const Edge& a, const Edge& b) {
    return a.key != b.key ? a.key < b.key : a.place != b.place ? a.place < b.place : a.local < b.local;
  });
  for (std::size_t i = 0; i < edges.size(); ++i)
    if (i == 0 || edges[i].key != edges[i - 1].key) uses[edges[i].place] |= 8 << edges[i].local;
  return uses;
}

/// Sums up the distances from some consecutive triangles of one surface.
class Sampler {
 public:
  Sampler(const TriangleMesh& mesh, const ClosestPoint& other) : mesh_(mesh), other_(other) {}

  void add_triangle(Index t, double area, int m, int first_use) {
    const Vec3 a = mesh_.positions[mesh_.triangles[t][0]], b = mesh_.positions[mesh_.triangles[t][1]],
               c = mesh_.positions[mesh_.triangles[t][2]];
    const auto at = [&](double u, double v) { return Vec3(a + u * (b - a) + v * (c - a)); };
    double sum = 0;
    for (int i = 0; i < m; ++i)
      for (int j = 0; i + j < m; ++j) {
        sum += distance(at((i + 1 / 3.0) / m, (j + 1 / 3.0) / m));
        if (i + j + 1 < m) sum += distance(at((i + 2 / 3.0) / m, (j + 2 / 3.0) / m));
      }
    result.mean += area * sum / (static_cast<double>(m) * m);
    const Vec3 corners[3] = {a, b, c};
    for (int k = 0; k < 3; ++k) {
      if (first_use & 1 << k) distance(corners[k]);
      if (first_use & 8 << k) distance(0.5 * (corners[k] + corners[(k + 1) % 3]));
    }
  }

  OneSided result;  ///< `mean` is still the integral, not divided by the area

 private:
  double distance(const Vec3& p) {
    const ClosestPoint::Hit hit = other_.closest(p, hint_);
    hint_ = hit.triangle;
    if (hit.distance > result.max.distance || any_++ == 0) result.max = {hit.distance, p, hit.point};
    return hit.distance;
  }

  const TriangleMesh& mesh_;
  const ClosestPoint& other_;
  Index hint_ = kNoIndex;
  int any_ = 0;
};

OneSided one_sided(const TriangleMesh& from, std::span<const Index> order, const ClosestPoint& to,
                   const SurfaceDistanceOptions& options) {
  std::vector<double> areas(order.size());
  double total = 0;
  for (std::size_t place = 0; place < order.size(); ++place) total += areas[place] = area_of(from, order[place]);
  const std::vector<std::uint8_t> uses =
      options.extremes ? first_uses(from, order) : std::vector<std::uint8_t>(order.size(), 0);
  constexpr std::size_t kRun = 32;  // sums and hints stay within a run, whatever thread takes it
  std::vector<OneSided> runs((order.size() + kRun - 1) / kRun);
#pragma omp parallel for schedule(dynamic)
  for (std::size_t run = 0; run < runs.size(); ++run) {
    Sampler sampler(from, to);
    for (std::size_t place = run * kRun; place < std::min((run + 1) * kRun, order.size()); ++place) {
      const double share = total > 0 ? areas[place] / total : 0;
      const int m = std::max(1, static_cast<int>(std::lround(std::sqrt(options.num_samples * share))));
      sampler.add_triangle(order[place], areas[place], m, uses[place]);
    }
    runs[run] = sampler.result;
  }
  OneSided result;
  for (const OneSided& run : runs) {
    result.mean += run.mean;
    if (&run == runs.data() || run.max.distance > result.max.distance) result.max = run.max;
  }
  result.mean = total > 0 ? result.mean / total : 0;
  return result;
}

}  // namespace

SurfaceDistance surface_distance(const TriangleMesh& a, const ClosestPoint& tree_a, const TriangleMesh& b,
                                 const ClosestPoint& tree_b, const SurfaceDistanceOptions& options) {
  if (options.num_samples < 1)
    throw InputError("surface distance: num_samples is " + std::to_string(options.num_samples) +
                     ", expected 1 or more");
  const OneSided forth = one_sided(a, tree_a.order(), tree_b, options);
  const OneSided back = one_sided(b, tree_b.order(), tree_a, options);
  return {forth.mean, back.mean, forth.max, back.max, false};
}

SurfaceDistance surface_distance(const TriangleMesh& a, const TriangleMesh& b, const SurfaceDistanceOptions& options) {
  return surface_distance(a, ClosestPoint(a), b, ClosestPoint(b), options);
}

SurfaceDistance surface_distance(const ClosestPoint& tree_a, std::span<const Vec3> b) {
  if (b.empty()) throw InputError("surface distance: there are no points");
  std::vector<ClosestPoint::Hit> hits(b.size());
  tree_a.closest(b, hits);
  SurfaceDistance result;
  result.one_sided = true;
  result.max_b_to_a = {hits[0].distance, b[0], hits[0].point};
  for (std::size_t j = 0; j < b.size(); ++j) {
    result.mean_b_to_a += hits[j].distance;
    if (hits[j].distance > result.max_b_to_a.distance) result.max_b_to_a = {hits[j].distance, b[j], hits[j].point};
  }
  result.mean_b_to_a /= static_cast<double>(b.size());
  return result;
}

SurfaceDistance surface_distance(const TriangleMesh& a, const PointCloud& b) {
  return surface_distance(ClosestPoint(a), b.points);
}

double bounding_box_diagonal(const PointCloud& cloud) {
  if (cloud.points.empty()) return 0;
  Vec3 low = cloud.points[0], high = low;
  for (const Vec3& p : cloud.points) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  return (high - low).norm();
}

double bounding_box_diagonal(const TriangleMesh& mesh) {
  if (mesh.triangles.empty()) return 0;
  Vec3 low = Vec3::Constant(std::numeric_limits<double>::infinity()), high = -low;
  for (const auto& triangle : mesh.triangles)
    for (const Index v : triangle) {
      low = low.cwiseMin(mesh.positions[v]);
      high = high.cwiseMax(mesh.positions[v]);
    }
  return (high - low).norm();
}

}  // namespace subvol
