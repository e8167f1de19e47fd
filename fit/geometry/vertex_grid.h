// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"

#include <Eigen/Geometry>

#include <array>
#include <cstdint>
#include <unordered_map>
#include <vector>

namespace subvol::internal {

/// Vertices in the cells of a grid, for finding those near a point.
class VertexGrid {
 public:
  /// box       of the vertices.
  /// distance  up to which vertices are looked for, > 0 unless the box has a size.
  VertexGrid(const Eigen::AlignedBox3d& box, double distance);

  /// False if the vertices lie too far apart for numbers, or all in one place: the grid then has no cells.
  bool is_usable() const;
  /// Adds a vertex, which is not there yet.
  void add(Index v, const Vec3& position);

  /// Calls visit(vertex) for all vertices in cells that a ball of the distance's radius meets, and maybe some others.
  template <class Visit>
  void for_each_near(const Vec3& point, const Visit& visit) const {
    const Vec3 reach = Vec3::Constant(distance_);
    const Cell low = cell_of(point - reach), high = cell_of(point + reach);
    for (std::int64_t i = low[0]; i <= high[0]; ++i)
      for (std::int64_t j = low[1]; j <= high[1]; ++j)
        for (std::int64_t k = low[2]; k <= high[2]; ++k) {
          const auto found = first_.find(key({i, j, k}));
          if (found == first_.end()) continue;
          for (Index v = found->second; v != kNoIndex; v = next_[v]) visit(v);
        }
  }

 private:
  using Cell = std::array<std::int64_t, 3>;
  Cell cell_of(const Vec3& point) const;
  /// A number of a cell, of which equal ones are rare.
  static std::uint64_t key(const Cell& cell);

  double distance_, cell_;
  Vec3 low_;
  std::unordered_map<std::uint64_t, Index> first_;  ///< vertex of each cell that was added last
  std::vector<Index> next_;                         ///< the one that was added before, for each vertex
};

}  // namespace subvol::internal
