// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/geometry/vertex_grid.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace subvol::internal {

VertexGrid::VertexGrid(const Eigen::AlignedBox3d& box, double distance) : distance_(distance), low_(box.min()) {
  constexpr double kCellSize = 4;          // distances: a ball meets 3.4 cells on average
  constexpr double kLeastCellSize = 1e-9;  // share of the extent, so that numbers of cells fit into an integer
  cell_ = box.isEmpty() ? 0 : std::max(kCellSize * distance, kLeastCellSize * box.sizes().maxCoeff());
}

bool VertexGrid::is_usable() const { return std::isfinite(cell_) && cell_ > 0; }

void VertexGrid::add(Index v, const Vec3& position) {
  const auto at = static_cast<Index>(entries_.size());
  const auto [last, is_new] = last_.try_emplace(key(cell_of(position)), at);
  entries_.push_back({v, is_new ? kNoIndex : last->second, position});
  last->second = at;
}

Index VertexGrid::nearest(const Vec3& point, std::size_t& num_tests) const {
  std::pair<double, Index> nearest{distance_, kNoIndex};
  for_each_near(point, [&](Index v, const Vec3& position) {
    ++num_tests;
    const std::pair<double, Index> found{(position - point).norm(), v};
    if (found.first <= distance_ && (nearest.second == kNoIndex || found < nearest)) nearest = found;
  });
  return nearest.second;
}

VertexGrid::Cell VertexGrid::cell_of(const Vec3& point) const {
  Cell cell;
  for (int k = 0; k < 3; ++k) cell[k] = static_cast<std::int64_t>(std::floor((point[k] - low_[k]) / cell_));
  return cell;
}

std::uint64_t VertexGrid::key(const Cell& cell) {
  std::uint64_t key = 0;
  for (const std::int64_t number : cell) {
    key = (key ^ static_cast<std::uint64_t>(number)) * 0x9e3779b97f4a7c15ULL;
    key ^= key >> 32;
  }
  return key;
}

}  // namespace subvol::internal
