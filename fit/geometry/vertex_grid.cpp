// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/geometry/vertex_grid.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace subvol::internal {

VertexGrid::VertexGrid(const Eigen::AlignedBox3d& box, double distance) : distance_(distance), low_(box.min()) {
  constexpr double kCellSize = 4;          // distances: a ball meets 3.4 cells on average
  constexpr double kLeastCellSize = 1e-9;  // share of the extent, so that numbers of cells fit into an integer
  cell_ = box.isEmpty() ? 0 : std::max(kCellSize * distance, kLeastCellSize * box.sizes().maxCoeff());
}

bool VertexGrid::is_usable() const { return std::isfinite(cell_) && cell_ > 0; }

void VertexGrid::add(Index v, const Vec3& position) {
  if (static_cast<std::size_t>(v) >= next_.size()) next_.resize(v + 1, kNoIndex);
  const auto [found, is_new] = first_.try_emplace(key(cell_of(position)), v);
  if (is_new) return;
  next_[v] = found->second;
  found->second = v;
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
