// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/geometry/surface_distance.h"

#include "subvol/base/error.h"
#include "subvol/fit/geometry/closest_point.h"
#include "subvol/surface/triangle_geometry.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace subvol {

using namespace internal;

namespace {

struct OneSided {
  double mean = 0;
  SurfaceDistance::Extreme max;
  bool is_set = false;  ///< false: there is no distance yet
};

/// Where a surface is sampled. Triangles are named by their places in an order in which neighbors are close in space.
struct Samples {
  struct Vertex {
    Index number;
    double area;  ///< that it stands for
  };
  struct Edge {
    Index place;
    int corner;  ///< the edge leads from this corner to the next one
    int points;  ///< in its inside, evenly spread
  };
  std::vector<int> cuts;  ///< m of each triangle; 0 if only its corners are sampled
  std::vector<Vertex> vertices;
  std::vector<Edge> edges;  ///< that are sampled
  double area = 0;          ///< of all triangles
};

/// Returns the number of points at which an edge is sampled, which is odd: where a surface is sharp or ends, a fitted
/// one is farthest. at_edge  the sides of triangles that are known there; one may be an edge beside triangles that are
/// not (`all_known`). spacing  of the samples.
template <class Keyed>
int points_of_edge(const TriangleMesh& mesh, std::span<const Index> order, std::span<const Keyed> at_edge,
                   bool all_known, double spacing) {
  constexpr double kSmoothCosine = 0.985;   // of 10 degrees
  constexpr double kMostEdgePoints = 1000;  // however long the edge is
  if (at_edge.size() == 1 && !all_known) return 1;
  const auto corners = [&](const Keyed& side) { return mesh.triangles[order[side.edge.place]]; };
  const auto normal = [&](const Keyed& side) { return triangle_normal(mesh, order[side.edge.place]); };
  const auto is_forward = [&](const Keyed& side) {
    const int k = side.edge.corner;
    return corners(side)[k] < corners(side)[(k + 1) % 3];
  };
  if (at_edge.size() == 2) {
    const double sign = is_forward(at_edge[0]) == is_forward(at_edge[1]) ? -1 : 1;
    if (sign * normal(at_edge[0]).dot(normal(at_edge[1])) > kSmoothCosine) return 1;
  }
  const int k = at_edge[0].edge.corner;
  const double length =
      (mesh.positions[corners(at_edge[0])[(k + 1) % 3]] - mesh.positions[corners(at_edge[0])[k]]).norm();
  return spacing > 0 ? static_cast<int>(std::clamp(std::round(length / spacing) - 1, 1.0, kMostEdgePoints)) | 1 : 1;
}

/// Returns the edges of the triangles that are cut, each once, in ascending order of their places.
/// spacing  of the samples.
std::vector<Samples::Edge> edges_of(const TriangleMesh& mesh, std::span<const Index> order, std::span<const int> cuts,
                                    double spacing) {
  struct Keyed {
    std::uint64_t key;
    Samples::Edge edge;
  };
  std::vector<Keyed> all;
  for (std::size_t place = 0; place < order.size(); ++place) {
    if (cuts[place] == 0) continue;
    for (int k = 0; k < 3; ++k) {
      const auto& corners = mesh.triangles[order[place]];
      const auto [low, high] = std::minmax(corners[k], corners[(k + 1) % 3]);
      all.push_back({static_cast<std::uint64_t>(low) << 32 | static_cast<std::uint32_t>(high),
                     {static_cast<Index>(place), k, 1}});
    }
  }
  const auto at = [](const Samples::Edge& edge) { return std::pair(edge.place, edge.corner); };
  std::sort(all.begin(), all.end(),
            [&](const Keyed& a, const Keyed& b) { return a.key != b.key ? a.key < b.key : at(a.edge) < at(b.edge); });
  const bool all_known = std::ranges::find(cuts, 0) == cuts.end();
  std::vector<Samples::Edge> edges;
  for (std::size_t first = 0, last; first < all.size(); first = last) {
    for (last = first + 1; last < all.size() && all[last].key == all[first].key;) ++last;
    edges.push_back(all[first].edge);
    edges.back().points =
        points_of_edge(mesh, order, std::span<const Keyed>(all).subspan(first, last - first), all_known, spacing);
  }
  std::sort(edges.begin(), edges.end(), [&](const Samples::Edge& a, const Samples::Edge& b) { return at(a) < at(b); });
  return edges;
}

Samples samples_of(const TriangleMesh& mesh, std::span<const Index> order, const SurfaceDistanceOptions& options) {
  // If there are more than kDenseTrianglesPerSample triangles per sample, a triangle of less than kLeastSampledShare of
  // a sample's area is sampled at its corners only. A fitted surface is farthest at its corners: a coarse one must not
  // be sampled so.
  constexpr std::size_t kDenseTrianglesPerSample = 4;
  constexpr double kLeastSampledShare = 0.125;
  Samples samples;
  std::vector<double> areas(order.size());
  for (std::size_t place = 0; place < order.size(); ++place)
    samples.area += areas[place] = triangle_area(mesh, mesh.triangles[order[place]]);
  const bool is_dense = order.size() > kDenseTrianglesPerSample * static_cast<std::size_t>(options.num_samples);
  std::vector<double> of_vertex(mesh.positions.size(), 0);
  for (std::size_t place = 0; place < order.size(); ++place) {
    const double share = samples.area > 0 ? options.num_samples * (areas[place] / samples.area) : 0;
    const bool is_small = is_dense && share < kLeastSampledShare;
    samples.cuts.push_back(is_small ? 0 : std::max(1, static_cast<int>(std::lround(std::sqrt(share)))));
    if (is_small)
      for (const Index v : mesh.triangles[order[place]]) of_vertex[v] += areas[place] / 3;
  }
  std::vector<char> seen(mesh.positions.size(), 0);
  for (const Index t : order)
    for (const Index v : mesh.triangles[t])
      if (!std::exchange(seen[v], 1) && (options.extremes || of_vertex[v] > 0))
        samples.vertices.push_back({v, of_vertex[v]});
  if (options.extremes)
    samples.edges = edges_of(mesh, order, samples.cuts, std::sqrt(samples.area / options.num_samples));
  return samples;
}

/// Sums up the distances of some consecutive samples of one surface.
class Sampler {
 public:
  explicit Sampler(const ClosestPoint& other) : other_(other) {}

  double distance(const Vec3& p) {
    const ClosestPoint::Hit hit = other_.closest(p, hint_);
    hint_ = hit.triangle;
    if (hit.distance > result.max.distance || !result.is_set) result.max = {hit.distance, p, hit.point};
    result.is_set = true;
    return hit.distance;
  }

  /// Adds the centroids of the m^2 parts of a triangle.
  void add_triangle(const std::array<Vec3, 3>& x, double area, int m) {
    const auto at = [&](double u, double v) { return Vec3(x[0] + u * (x[1] - x[0]) + v * (x[2] - x[0])); };
    double sum = 0;
    for (int i = 0; i < m; ++i)
      for (int j = 0; i + j < m; ++j) {
        sum += distance(at((i + 1 / 3.0) / m, (j + 1 / 3.0) / m));
        if (i + j + 1 < m) sum += distance(at((i + 2 / 3.0) / m, (j + 2 / 3.0) / m));
      }
    result.mean += area * sum / (static_cast<double>(m) * m);
  }

  OneSided result;  ///< `mean` is still the integral, not divided by the area

 private:
  const ClosestPoint& other_;
  Index hint_ = kNoIndex;
};

/// Calls add(sampler, i) for all i < n and adds the results up. Sums and hints stay within a run, whatever thread takes
/// it.
template <class Add>
void sample(std::size_t n, const ClosestPoint& to, const Add& add, OneSided& result) {
  constexpr std::size_t kSamplesPerRun = 128;
  std::vector<OneSided> runs((n + kSamplesPerRun - 1) / kSamplesPerRun);
#pragma omp parallel for schedule(dynamic)
  for (std::size_t run = 0; run < runs.size(); ++run) {
    Sampler sampler(to);
    for (std::size_t i = run * kSamplesPerRun; i < std::min((run + 1) * kSamplesPerRun, n); ++i) add(sampler, i);
    runs[run] = sampler.result;
  }
  for (const OneSided& run : runs) {
    result.mean += run.mean;
    if (!run.is_set || (result.is_set && run.max.distance <= result.max.distance)) continue;
    result.max = run.max;
    result.is_set = true;
  }
}

OneSided one_sided(const TriangleMesh& from, std::span<const Index> order, const ClosestPoint& to,
                   const SurfaceDistanceOptions& options) {
  const Samples samples = samples_of(from, order, options);
  const auto corners = [&](Index place) {
    const auto& [a, b, c] = from.triangles[order[place]];
    return std::array{from.positions[a], from.positions[b], from.positions[c]};
  };
  OneSided result;
  sample(
      order.size(), to,
      [&](Sampler& sampler, std::size_t place) {
        if (samples.cuts[place] == 0) return;
        sampler.add_triangle(corners(static_cast<Index>(place)), triangle_area(from, from.triangles[order[place]]),
                             samples.cuts[place]);
      },
      result);
  sample(
      samples.vertices.size(), to,
      [&](Sampler& sampler, std::size_t i) {
        const auto& [number, area] = samples.vertices[i];
        sampler.result.mean += area * sampler.distance(from.positions[number]);
      },
      result);
  sample(
      samples.edges.size(), to,
      [&](Sampler& sampler, std::size_t i) {
        const auto& [place, corner, points] = samples.edges[i];
        const std::array<Vec3, 3> x = corners(place);
        const Vec3 &begin = x[corner], &end = x[(corner + 1) % 3];
        for (int k = 1; k <= points; ++k) sampler.distance(begin + k / (points + 1.0) * (end - begin));
      },
      result);
  result.mean = samples.area > 0 ? result.mean / samples.area : 0;
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
