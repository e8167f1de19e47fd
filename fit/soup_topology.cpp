// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/soup_topology.h"

#include <algorithm>
#include <compare>
#include <numeric>
#include <utility>
#include <vector>

namespace subvol {

namespace {

/// Equal positions of corners get equal numbers; other vertices keep their own.
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
  auto operator<=>(const HalfEdge&) const = default;
};

}  // namespace

SoupTopology soup_topology(std::span<const Vec3> positions, std::span<const std::array<Index, 3>> triangles) {
  const std::vector<Index> number = merged_numbers(positions, triangles);
  std::vector<HalfEdge> half_edges;
  half_edges.reserve(3 * triangles.size());
  std::vector<char> used(positions.size(), 0);
  for (const auto& t : triangles) {
    const Index corners[3] = {number[t[0]], number[t[1]], number[t[2]]};
    if (corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0]) continue;
    for (int k = 0; k < 3; ++k) {
      const Index a = corners[k], b = corners[(k + 1) % 3];
      half_edges.push_back({std::min(a, b), std::max(a, b), a < b});
      used[a] = 1;
    }
  }
  if (half_edges.empty()) return {};
  std::sort(half_edges.begin(), half_edges.end());
  std::size_t matched = 0;
  long num_edges = 0;
  for (std::size_t first = 0, last; first < half_edges.size(); first = last) {
    const HalfEdge& edge = half_edges[first];
    long forward = 0, backward = 0;
    for (last = first; last < half_edges.size() && half_edges[last].low == edge.low && half_edges[last].high == edge.high;
         ++last)
      ++(half_edges[last].forward ? forward : backward);
    // Where surfaces touch along an edge there are several, each with one half-edge of either direction.
    matched += static_cast<std::size_t>(2 * std::min(forward, backward));
    num_edges += std::max(forward, backward);
  }
  const long num_triangles = static_cast<long>(half_edges.size() / 3);
  return {static_cast<double>(matched) / static_cast<double>(half_edges.size()),
          std::count(used.begin(), used.end(), 1) - num_edges + num_triangles};
}

}  // namespace subvol
