// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/mending/near_vertices.h"

#include "subvol/base/disjoint_sets.h"
#include "subvol/base/sort_unique.h"
#include "subvol/fit/geometry/vertex_grid.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cstddef>
#include <map>
#include <numeric>
#include <set>
#include <tuple>
#include <utility>

namespace subvol::internal {

namespace {

/// Ways along the rims of a surface.
class RimWays {
 public:
  RimWays(std::span<const Vec3> positions, std::span<const std::array<Index, 2>> rims) : positions_(positions) {
    for (const auto& [a, b] : rims) {
      ends_.push_back({a, b});
      ends_.push_back({b, a});
    }
    std::sort(ends_.begin(), ends_.end());
  }

  /// Returns the vertices that must not become one with a vertex, ascending: its neighbors, and those within a distance
  /// to which the way along the rims is short.
  /// same  returns the vertices that have become one with a vertex, itself included: a way goes on from each of them.
  template <class Same>
  std::vector<Index> close_to(Index v, double distance, const Same& same) const {
    constexpr double kShortWay = 2;  // in straight distances; a semicircle has 1.6
    std::map<Index, double> ways;
    std::set<std::pair<double, Index>> front;
    std::vector<Index> close;
    const auto reach = [&](Index to, double way) {
      for (const Index w : same(to)) {
        const auto [known, is_new] = ways.try_emplace(w, way);
        if (!is_new && known->second <= way) continue;
        if (!is_new) front.erase({known->second, w});
        known->second = way;
        front.insert({way, w});
      }
    };
    reach(v, 0);
    while (!front.empty()) {
      const auto [way, at] = *front.begin();
      front.erase(front.begin());
      if (way > 0 && way <= kShortWay * (positions_[at] - positions_[v]).norm()) close.push_back(at);
      for (auto next = std::lower_bound(ends_.begin(), ends_.end(), std::array<Index, 2>{at, 0});
           next != ends_.end() && (*next)[0] == at; ++next) {
        const Index to = (*next)[1];
        const double length = way + (positions_[to] - positions_[at]).norm();
        if (way == 0) close.push_back(to);
        if (length <= kShortWay * distance) reach(to, length);
      }
    }
    std::sort(close.begin(), close.end());
    return close;
  }

 private:
  std::span<const Vec3> positions_;
  std::vector<std::array<Index, 2>> ends_;  ///< of the rims' edges, both ways, ascending
};

/// Comparisons of two positions after which a search ends: a second or two.
constexpr std::size_t kMostComparisons = 300'000'000;
constexpr std::size_t kWayCost = 50;  ///< of a vertex that a way along rims passes, in comparisons

VertexGrid grid_for(std::span<const Vec3> positions, std::span<const Index> vertices, double distance) {
  Eigen::AlignedBox3d box;
  for (const Index v : vertices) box.extend(positions[v]);
  return {box, distance};
}

std::vector<Index> own_numbers(std::size_t count) {
  std::vector<Index> number(count);
  std::iota(number.begin(), number.end(), 0);
  return number;
}

/// Two vertices that may become one.
struct NearPair {
  double apart;
  Index low, high;
  friend bool operator<(const NearPair& a, const NearPair& b) {
    return std::tie(a.apart, a.low, a.high) < std::tie(b.apart, b.low, b.high);
  }
};

/// Sets of vertices at rims that become one.
class CrackSets {
 public:
  CrackSets(std::span<const Vec3> positions, std::span<const std::array<Index, 2>> rims, double distance)
      : positions_(positions), distance_(distance), rims_(rims), ways_(positions, rims), sets_(positions.size()) {}

  /// Returns false if there is too much to look at.
  bool find_pairs();
  void join_pairs();
  Index of(Index v) { return sets_.of(v); }

 private:
  std::vector<Index>& members(Index v) { return members_.try_emplace(v, std::vector<Index>{v}).first->second; }

  std::span<const Vec3> positions_;
  double distance_;
  std::span<const std::array<Index, 2>> rims_;
  RimWays ways_;
  DisjointSets sets_;
  std::vector<NearPair> pairs_;
  std::map<Index, std::vector<Index>> members_;  ///< of each set of several vertices, by the least one
};

bool CrackSets::find_pairs() {
  constexpr std::size_t kMostCrackPairs = 10'000'000;  // tests of distances, to bound the time
  std::vector<Index> vertices;
  for (const auto& edge : rims_) vertices.insert(vertices.end(), edge.begin(), edge.end());
  sort_unique(vertices);
  VertexGrid before = grid_for(positions_, vertices, distance_);
  if (!before.is_usable()) return false;
  std::size_t cost = 0;
  std::vector<NearPair> near;
  for (const Index v : vertices) {
    near.clear();
    before.for_each_near(positions_[v], [&](Index w, const Vec3& position) {
      ++cost;
      const double apart = (position - positions_[v]).norm();
      if (apart <= distance_) near.push_back({apart, w, v});
    });
    before.add(v, positions_[v]);
    if (near.empty()) continue;
    const std::vector<Index> close = ways_.close_to(v, distance_, [](Index w) { return std::array<Index, 1>{w}; });
    cost += kWayCost * close.size();
    for (const NearPair& pair : near)
      if (!std::binary_search(close.begin(), close.end(), pair.low)) pairs_.push_back(pair);
    if (cost > kMostComparisons || pairs_.size() > kMostCrackPairs) return false;
  }
  return true;
}

void CrackSets::join_pairs() {
  std::sort(pairs_.begin(), pairs_.end());
  std::size_t cost = 0;
  for (const NearPair& pair : pairs_) {
    const Index low = std::min(sets_.of(pair.low), sets_.of(pair.high));
    const Index high = std::max(sets_.of(pair.low), sets_.of(pair.high));
    if (low == high || cost > kMostComparisons) continue;
    std::vector<Index>&those = members(low), &others = members(high);
    cost += others.size();
    const auto is_far = [&](Index w) { return !((positions_[w] - positions_[low]).norm() <= distance_); };
    if (std::any_of(others.begin(), others.end(), is_far)) continue;
    const std::vector<Index> close =
        ways_.close_to(low, distance_, [&](Index v) -> const std::vector<Index>& { return members(sets_.of(v)); });
    cost += kWayCost * close.size();
    const auto is_close = [&](Index w) { return std::binary_search(close.begin(), close.end(), w); };
    if (std::any_of(others.begin(), others.end(), is_close)) continue;
    those.insert(those.end(), others.begin(), others.end());
    members_.erase(high);
    sets_.join(low, high);
  }
}

}  // namespace

std::vector<Index> near_vertices(std::span<const Vec3> positions, std::span<const Index> vertices, double distance) {
  std::vector<Index> number = own_numbers(positions.size());
  VertexGrid staying = grid_for(positions, vertices, distance);
  if (!staying.is_usable()) return number;
  std::size_t cost = 0;
  for (const Index v : vertices) {
    const Index nearest = staying.nearest(positions[v], cost);
    if (cost > kMostComparisons) break;
    if (nearest == kNoIndex)
      staying.add(v, positions[v]);
    else
      number[v] = nearest;
  }
  return number;
}

std::vector<Index> crack_vertices(std::span<const Vec3> positions, std::span<const std::array<Index, 2>> rims,
                                  double distance) {
  std::vector<Index> number = own_numbers(positions.size());
  CrackSets sets(positions, rims, distance);
  if (rims.empty() || !sets.find_pairs()) return number;
  sets.join_pairs();
  for (Index& v : number) v = sets.of(v);
  return number;
}

}  // namespace subvol::internal
