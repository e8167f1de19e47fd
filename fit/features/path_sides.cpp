// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/features/path_sides.h"

#include "subvol/base/disjoint_sets.h"
#include "subvol/base/sort_unique.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <utility>

namespace subvol::internal {

namespace {

/// Marks the vertices of a graph that no closed path passes through: those with fewer than two neighbors, and those
/// left with fewer once these are taken away.
std::vector<std::uint8_t> dead_ends(const std::vector<std::vector<Index>>& neighbors) {
  std::vector<std::uint8_t> is_dead(neighbors.size());
  std::vector<std::size_t> degrees;
  std::vector<Index> next;
  for (std::size_t i = 0; i < neighbors.size(); ++i) {
    degrees.push_back(neighbors[i].size());
    if (degrees[i] < 2) next.push_back(static_cast<Index>(i));
  }
  while (!next.empty()) {
    const Index dead = next.back();
    next.pop_back();
    if (std::exchange(is_dead[dead], 1)) continue;
    for (const Index other : neighbors[dead])
      if (--degrees[other] < 2 && !is_dead[other]) next.push_back(other);
  }
  return is_dead;
}

}  // namespace

std::vector<std::vector<Index>> path_sides(const RoutingGraph& graph, std::span<const Vec3> points, double reach,
                                           const Occupied& occupied) {
  std::vector<Index> near;
  for (const Vec3& point : points)
    for (const Index v : graph.vertices_near(point, reach))
      if (!occupied.vertices[v]) near.push_back(v);
  sort_unique(near);
  std::vector<std::vector<Index>> neighbors(near.size());  // places in `near`
  for (std::size_t i = 0; i < near.size(); ++i)
    for (const Index e : graph.edges_at(near[i])) {
      const auto at = std::ranges::lower_bound(near, graph.other_end(e, near[i]));
      if (at != near.end() && *at == graph.other_end(e, near[i]) && !occupied.edges[e])
        neighbors[i].push_back(static_cast<Index>(at - near.begin()));
    }
  const std::vector<std::uint8_t> is_dead = dead_ends(neighbors);
  DisjointSets sides(near.size());
  for (std::size_t i = 0; i < near.size(); ++i)
    for (const Index other : neighbors[i])
      if (!is_dead[i] && !is_dead[other]) sides.join(static_cast<Index>(i), other);
  std::map<Index, std::vector<Index>> by_side;
  for (std::size_t i = 0; i < near.size(); ++i)
    if (!is_dead[i]) by_side[sides.of(static_cast<Index>(i))].push_back(near[i]);
  std::vector<std::vector<Index>> result;
  for (auto& [side, vertices] : by_side) result.push_back(std::move(vertices));
  return result;
}

}  // namespace subvol::internal
