// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/target/soup_topology.h"

#include <algorithm>
#include <compare>
#include <numeric>
#include <utility>
#include <vector>

namespace subvol {

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

struct HalfEdge {
  Index low, high;
  bool forward;
  Index triangle;
  int corner;
  auto operator<=>(const HalfEdge&) const = default;
};

/// Returns all half-edges, except those of triangles with equal corners. Half-edges of one edge are consecutive.
std::vector<HalfEdge> sorted_half_edges(std::span<const Vec3> positions,
                                        std::span<const std::array<Index, 3>> triangles) {
  const std::vector<Index> number = merged_numbers(positions, triangles);
  std::vector<HalfEdge> half_edges;
  half_edges.reserve(3 * triangles.size());
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    const Index corners[3] = {number[triangles[t][0]], number[triangles[t][1]], number[triangles[t][2]]};
    if (corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0]) continue;
    for (int k = 0; k < 3; ++k) {
      const Index a = corners[k], b = corners[(k + 1) % 3];
      half_edges.push_back({std::min(a, b), std::max(a, b), a < b, static_cast<Index>(t), k});
    }
  }
  std::sort(half_edges.begin(), half_edges.end());
  return half_edges;
}

/// Calls visit(half-edges) for each edge.
template <class Visit>
void for_each_edge(std::span<const HalfEdge> half_edges, const Visit& visit) {
  for (std::size_t first = 0, last; first < half_edges.size(); first = last) {
    const HalfEdge& edge = half_edges[first];
    for (last = first + 1;
         last < half_edges.size() && half_edges[last].low == edge.low && half_edges[last].high == edge.high;)
      ++last;
    visit(half_edges.subspan(first, last - first));
  }
}

/// Returns the parts of each triangle on the boundary, as `soup_topology` describes them.
std::vector<std::uint8_t> parts_on_rim(std::span<const HalfEdge> half_edges, std::size_t num_vertices,
                                       std::size_t num_triangles) {
  std::vector<std::uint8_t> parts(num_triangles, 0);
  std::vector<char> on_rim(num_vertices, 0);
  for_each_edge(half_edges, [&](std::span<const HalfEdge> edge) {
    if (edge.size() > 1) return;
    on_rim[edge[0].low] = on_rim[edge[0].high] = 1;
    parts[edge[0].triangle] |= static_cast<std::uint8_t>(1 << edge[0].corner);
  });
  for (const HalfEdge& h : half_edges)
    if (on_rim[h.forward ? h.low : h.high]) parts[h.triangle] |= static_cast<std::uint8_t>(8 << h.corner);
  return parts;
}

}  // namespace

SoupTopology soup_topology(std::span<const Vec3> positions, std::span<const std::array<Index, 3>> triangles,
                           std::vector<std::uint8_t>* rim_parts) {
  const std::vector<HalfEdge> half_edges = sorted_half_edges(positions, triangles);
  if (rim_parts) *rim_parts = parts_on_rim(half_edges, positions.size(), triangles.size());
  if (half_edges.empty()) return {};
  SoupTopology result;
  std::vector<char> used(positions.size(), 0);
  std::size_t matched = 0;
  long num_edges = 0;
  for_each_edge(half_edges, [&](std::span<const HalfEdge> edge) {
    const auto forward = std::count_if(edge.begin(), edge.end(), [](const HalfEdge& h) { return h.forward; });
    const auto backward = static_cast<long>(edge.size()) - forward;
    // An edge along which surfaces touch counts as several edges, each with one half-edge of either direction.
    matched += static_cast<std::size_t>(2 * std::min(forward, backward));
    num_edges += std::max(forward, backward);
    result.open_edges += edge.size() == 1;
    result.turned_edges += edge.size() == 2 && forward != backward;
    result.crowded_edges += edge.size() > 2;
    used[edge[0].low] = used[edge[0].high] = 1;
  });
  const long num_triangles = static_cast<long>(half_edges.size() / 3);
  result.closed_share = static_cast<double>(matched) / static_cast<double>(half_edges.size());
  result.euler_number = std::count(used.begin(), used.end(), 1) - num_edges + num_triangles;
  return result;
}

}  // namespace subvol
