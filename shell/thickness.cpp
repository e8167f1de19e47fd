// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/shell/thickness.h"

#include "subvol/base/error.h"
#include "subvol/fit/geometry/closest_point.h"
#include "subvol/fit/geometry/surface_distance.h"
#include "subvol/fit/mending/surface_faults.h"
#include "subvol/fit/mending/visible_normals.h"
#include "subvol/shell/ray_gap.h"
#include "subvol/surface/boundary.h"

#include <algorithm>
#include <functional>
#include <queue>
#include <set>
#include <string>

namespace subvol {

using namespace internal;
namespace {

/// Calls visit(a, b, length) for every edge of the surface.
template <class Visit>
void for_each_edge(const ShellLayers& layers, const Visit& visit) {
  const SurfaceTopology& topology = layers.topology;
  for (const Index h : topology.edge_corners) {
    const Index a = topology.corner_vertices[h], b = topology.corner_vertices[topology.next(h)];
    visit(a, b, (layers.surface.positions[a] - layers.surface.positions[b]).norm());
  }
}

struct Neighbor {
  Index vertex;
  double length;
};

/// The neighbors of every vertex along edges.
struct Neighbors {
  std::vector<std::size_t> offsets;
  std::vector<Neighbor> list;

  explicit Neighbors(const ShellLayers& layers) : offsets(layers.num_columns() + 1, 0) {
    for_each_edge(layers, [&](Index a, Index b, double) { ++offsets[a + 1], ++offsets[b + 1]; });
    for (std::size_t v = 1; v < offsets.size(); ++v) offsets[v] += offsets[v - 1];
    list.resize(offsets.back());
    std::vector<std::size_t> next(offsets.begin(), offsets.end() - 1);
    for_each_edge(layers, [&](Index a, Index b, double length) {
      list[next[a]++] = {b, length};
      list[next[b]++] = {a, length};
    });
  }
};

/// Works like Dijkstra's algorithm: a vertex that was lowered limits its neighbors, the thinnest first.
void limit_slope(const Neighbors& neighbors, std::span<double> thickness) {
  constexpr double kMostThicknessSlope = 0.5;  // of the thickness along the surface: an angle of 27 degrees
  using Entry = std::pair<double, Index>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  const auto spread = [&](double t, Index v) {
    for (std::size_t i = neighbors.offsets[v]; i < neighbors.offsets[v + 1]; ++i) {
      const auto& [w, length] = neighbors.list[i];
      const double most = t + kMostThicknessSlope * length;
      if (thickness[w] <= most) continue;
      thickness[w] = most;
      queue.push({most, w});
    }
  };
  for (std::size_t v = 0; v < thickness.size(); ++v) spread(thickness[v], static_cast<Index>(v));
  while (!queue.empty()) {
    const auto [t, v] = queue.top();
    queue.pop();
    if (t == thickness[v]) spread(t, v);
  }
}

}  // namespace

void limit_slope(const ShellLayers& layers, std::span<double> thickness) {
  const Neighbors neighbors(layers);
  const std::size_t n = layers.num_columns();
  if (layers.inside > 0) limit_slope(neighbors, thickness.subspan(0, n));
  if (layers.outside > 0) limit_slope(neighbors, thickness.subspan(n, n));
}

std::vector<double> limited_thickness(const ShellLayers& layers, std::span<const Vec3> directions,
                                      std::span<const double> asked) {
  // Share of the gap, so that two strands leave a tenth of it, and the least share of the thickness asked for, which
  // keeps it positive.
  constexpr double kMostGapShare = 0.45, kLeastThicknessShare = 1e-4;
  std::vector<double> thickness(asked.begin(), asked.end());
  const TriangleMesh surface = triangulate(layers.surface);
  const double diagonal = bounding_box_diagonal(surface);
  const auto limit = [&](std::size_t first, double sign) {
    std::vector<Vec3> along(directions.begin(), directions.end());
    for (Vec3& d : along) d *= sign;
    const std::vector<double> gaps = ray_gaps(surface, along);
    for (std::size_t v = 0; v < gaps.size(); ++v) {
      double& t = thickness[first + v];
      t = std::min(t, diagonal);
      t = std::max(std::min(t, kMostGapShare * gaps[v]), kLeastThicknessShare * t);
    }
  };
  if (layers.inside > 0) limit(0, -1);
  if (layers.outside > 0) limit(layers.num_columns(), 1);
  limit_slope(layers, thickness);
  return thickness;
}

MeasuredThickness measure_thickness(const ShellLayers& layers, std::span<const Vec3> positions) {
  const ClosestPoint tree(triangulate(layers.surface));
  const std::size_t n = layers.num_columns();
  MeasuredThickness measured{std::vector<double>(layers.num_strands(), 0.0),
                             std::vector<double>(layers.num_strands(), 0.0)};
  std::vector<ClosestPoint::Hit> hits(n);
  for (const int sheet : {0, layers.inside, layers.num_sheets() - 1}) {
    tree.closest(positions.subspan(layers.vertex(sheet, 0), n), hits);
    for (std::size_t v = 0; v < n; ++v) {
      const Index vertex = layers.vertex(sheet, static_cast<Index>(v)), strand = layers.strand(vertex);
      if (strand == kNoIndex) {
        measured.surface_distance_max = std::max(measured.surface_distance_max, hits[v].distance);
      } else {
        const Index foot = layers.vertex(layers.inside, static_cast<Index>(v));
        measured.achieved[strand] = (positions[vertex] - positions[foot]).norm();
        measured.clearance[strand] = hits[v].distance;
      }
    }
  }
  return measured;
}

void turn_into_planes(ShellLayers& layers, std::span<Vec3> directions) {
  constexpr double kLeastTurnedVisibility = 0.1;  // cosine between a turned direction and normals around it: 84 degrees
  const PolygonMesh& surface = layers.surface;
  std::vector<double> visibility(layers.num_columns(), 1);
  std::vector<Vec3> turned(directions.begin(), directions.end());
  for (std::size_t v = 0; v < turned.size(); ++v) {
    const auto column = static_cast<Index>(v);
    turned[v] = (layers.planes.projector({&column, 1}) * directions[v]).stableNormalized();
  }
  for (std::size_t f = 0; f < surface.num_faces(); ++f)
    for (std::size_t h = surface.face_offsets[f]; h < surface.face_offsets[f + 1]; ++h) {
      const Index v = surface.face_vertices[h];
      const double seen = turned[v].dot(corner_normal(surface, f, h - surface.face_offsets[f]));
      visibility[v] = std::min(visibility[v], seen);
    }
  for (std::size_t v = 0; v < turned.size(); ++v) {
    if (visibility[v] >= kLeastTurnedVisibility)
      directions[v] = turned[v];
    else
      layers.planes.release(static_cast<Index>(v));
  }
}

double distance_from_planes(const ShellLayers& layers, std::span<const Vec3> positions) {
  double largest = 0;
  if (layers.planes.empty()) return largest;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const auto column = static_cast<Index>(i % layers.num_columns());
    const Vec3 way = positions[i] - layers.surface.positions[column];
    largest = std::max(largest, (way - layers.planes.projector({&column, 1}) * way).norm());
  }
  return largest;
}

std::vector<Vec3> thinnest_shell(const ShellLayers& layers, const ShellCheck& check, std::span<const Vec3> directions,
                                 std::span<const double> thickness, const std::function<bool()>& cancelled,
                                 const std::function<std::string(std::span<const Index>)>& names) {
  constexpr double kThinShellEdgeShare = 0.02;  // of the shortest edge at a vertex: the first thickness that is tried
  constexpr int kMaxHalvings = 30;              // 1e-9 of the first thickness is none
  const std::size_t n = layers.num_columns();
  std::vector<double> thin(thickness.begin(), thickness.end());
  for_each_edge(layers, [&](Index a, Index b, double length) {
    for (const Index v : {a, b})
      for (double* t : {&thin[v], &thin[n + v]}) *t = std::min(*t, kThinShellEdgeShare * length);
  });
  bool ended = false;
  const auto is_to_end = [&] { return ended = ended || (cancelled && cancelled()); };
  for (int halving = 0;; ++halving) {
    std::vector<Vec3> positions = straight_columns(layers, directions, thin);
    const ShellFailures failures = check.failures(positions, is_to_end);
    if (ended) return {};
    if (failures.none()) return positions;
    const std::vector<Index> strands = check.strands(failures);
    if (halving == kMaxHalvings || strands.empty()) {
      std::set<Index> columns;
      for (const Index strand : strands) columns.insert(static_cast<Index>(strand % n));
      const std::vector<Index> vertices(columns.begin(), columns.end());
      throw InputError("not even a very thin layer fits at " + std::to_string(vertices.size()) +
                       (vertices.size() == 1 ? " vertex: " : " vertices: ") +
                       (names ? names(vertices) : text_of_vertices(vertices, layers.surface.positions)));
    }
    for (const Index strand : strands) thin[strand] *= 0.5;
  }
}

}  // namespace subvol
