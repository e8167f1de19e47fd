// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/target/soup_topology.h"

#include "subvol/surface/welded_surface.h"

#include <algorithm>
#include <numeric>
#include <utility>
#include <vector>

namespace subvol {

using namespace internal;

namespace {

/// Returns a number per vertex: corners at equal positions get equal numbers; other vertices keep their own.
std::vector<Index> merged_numbers(std::span<const Vec3> positions, std::span<const std::array<Index, 3>> triangles) {
  std::vector<Index> number(positions.size()), order;
  std::iota(number.begin(), number.end(), 0);
  std::vector<char> used(positions.size(), 0);
  for (const auto& t : triangles)
    for (Index v : t)
      if (!std::exchange(used[v], 1)) order.push_back(v);
  const auto less = [&](Index a, Index b) {
    return std::lexicographical_compare(positions[a].begin(), positions[a].end(), positions[b].begin(),
                                        positions[b].end());
  };
  std::sort(order.begin(), order.end(), less);
  for (std::size_t k = 1; k < order.size(); ++k)
    if (!less(order[k - 1], order[k])) number[order[k]] = number[order[k - 1]];
  return number;
}

/// Triangles whose corners at equal positions are one vertex, without those that have equal corners.
struct MergedTriangles {
  std::vector<std::array<Index, 3>> corners;
  std::vector<Index> numbers;  ///< of each in the input
  std::vector<SurfaceHalfEdge> sides;
};

MergedTriangles merged_triangles(std::span<const Vec3> positions, std::span<const std::array<Index, 3>> triangles) {
  const std::vector<Index> number = merged_numbers(positions, triangles);
  MergedTriangles result;
  result.corners.reserve(triangles.size());
  result.numbers.reserve(triangles.size());
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    const auto [a, b, c] = triangles[t];
    const std::array<Index, 3> corners{number[a], number[b], number[c]};
    if (corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0]) continue;
    result.corners.push_back(corners);
    result.numbers.push_back(static_cast<Index>(t));
  }
  result.sides = sorted_half_edges(result.corners, positions.size());
  return result;
}

/// Returns the parts of each triangle on the boundary, as `soup_topology` describes them.
std::vector<std::uint8_t> parts_on_rim(const MergedTriangles& merged, std::size_t num_vertices,
                                       std::size_t num_triangles) {
  std::vector<std::uint8_t> parts(num_triangles, 0);
  std::vector<char> on_rim(num_vertices, 0);
  for_each_edge(merged.sides, [&](std::span<const SurfaceHalfEdge> edge) {
    if (edge.size() > 1) return;
    const auto& [low, high, triangle, forward] = edge[0];
    on_rim[low] = on_rim[high] = 1;
    const auto& corners = merged.corners[triangle];
    const auto corner = std::ranges::find(corners, forward ? low : high) - corners.begin();
    parts[merged.numbers[triangle]] |= static_cast<std::uint8_t>(1 << corner);
  });
  for (std::size_t t = 0; t < merged.corners.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k)
      if (on_rim[merged.corners[t][k]]) parts[merged.numbers[t]] |= static_cast<std::uint8_t>(8 << k);
  return parts;
}

}  // namespace

SoupTopology soup_topology(std::span<const Vec3> positions, std::span<const std::array<Index, 3>> triangles,
                           std::vector<std::uint8_t>* rim_parts) {
  const MergedTriangles merged = merged_triangles(positions, triangles);
  if (rim_parts) *rim_parts = parts_on_rim(merged, positions.size(), triangles.size());
  if (merged.corners.empty()) return {};
  SoupTopology result;
  std::vector<char> used(positions.size(), 0);
  std::size_t matched = 0;
  long num_edges = 0;
  for_each_edge(merged.sides, [&](std::span<const SurfaceHalfEdge> edge) {
    const auto forward = std::ranges::count_if(edge, &SurfaceHalfEdge::forward);
    const auto backward = static_cast<long>(edge.size()) - forward;
    // An edge along which surfaces touch counts as several edges, each with one half-edge of either direction.
    matched += static_cast<std::size_t>(2 * std::min(forward, backward));
    num_edges += std::max(forward, backward);
    result.open_edges += edge.size() == 1;
    result.turned_edges += edge.size() == 2 && forward != backward;
    result.crowded_edges += edge.size() > 2;
    used[edge[0].low] = used[edge[0].high] = 1;
  });
  const long num_triangles = static_cast<long>(merged.corners.size());
  result.closed_share = static_cast<double>(matched) / static_cast<double>(merged.sides.size());
  result.euler_number = std::count(used.begin(), used.end(), 1) - num_edges + num_triangles;
  return result;
}

}  // namespace subvol
