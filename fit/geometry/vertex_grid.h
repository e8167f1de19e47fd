// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"

#include <Eigen/Geometry>

#include <array>
#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <vector>

namespace subvol::internal {

/// Vertices in the cells of a grid, for finding those near a point. Its memory is that of the vertices it holds.
class VertexGrid {
 public:
  /// box       of the vertices.
  /// distance  up to which vertices are looked for, > 0 unless the box has a size.
  VertexGrid(const Eigen::AlignedBox3d& box, double distance);

  /// False if the vertices lie too far apart for numbers, or all in one place: the grid then has no cells.
  bool is_usable() const;
  void add(Index v, const Vec3& position);

  /// Returns the vertex nearest to a point, of equally near ones the least, within the distance; kNoIndex: none.
  /// num_tests  grows by the number of vertices that were looked at.
  Index nearest(const Vec3& point, std::size_t& num_tests) const;

  /// Calls visit(vertex, position) for all vertices in cells that a ball of the distance's radius meets, and maybe some
  /// others.
  template <class Visit>
  void for_each_near(const Vec3& point, const Visit& visit) const {
    const Vec3 reach = Vec3::Constant(distance_);
    const Cell low = cell_of(point - reach), high = cell_of(point + reach);
    for (std::int64_t i = low[0]; i <= high[0]; ++i)
      for (std::int64_t j = low[1]; j <= high[1]; ++j)
        for (std::int64_t k = low[2]; k <= high[2]; ++k) {
          const auto found = last_.find(key({i, j, k}));
          if (found == last_.end()) continue;
          for (Index at = found->second; at != kNoIndex; at = entries_[at].before)
            visit(entries_[at].vertex, entries_[at].position);
        }
  }

 private:
  using Cell = std::array<std::int64_t, 3>;
  Cell cell_of(const Vec3& point) const;
  /// A number of a cell, of which equal ones are rare.
  static std::uint64_t key(const Cell& cell);

  double distance_, cell_;
  Vec3 low_;
  struct Entry {
    Index vertex;
    Index before;  ///< place of the entry of the same cell that was added before
    Vec3 position;
  };
  std::vector<Entry> entries_;
  std::unordered_map<std::uint64_t, Index> last_;  ///< place of the entry of each cell that was added last
};

}  // namespace subvol::internal
