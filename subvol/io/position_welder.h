// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"

#include <array>
#include <map>
#include <utility>
#include <vector>

namespace subvol::internal {

/// Makes one vertex of equal positions, because formats repeat a vertex in every triangle (STL), or wherever its normal
/// differs (glTF).
class PositionWelder {
 public:
  /// Returns the number of the vertex at a position.
  Index vertex(const Vec3& position) {
    // + 0.0 turns -0.0 into 0.0.
    const std::array<double, 3> key = {position[0] + 0.0, position[1] + 0.0, position[2] + 0.0};
    const auto [it, is_new] = vertices_.try_emplace(key, static_cast<Index>(positions_.size()));
    if (is_new) positions_.push_back(position);
    return it->second;
  }
  std::vector<Vec3> take() { return std::move(positions_); }

 private:
  std::map<std::array<double, 3>, Index> vertices_;
  std::vector<Vec3> positions_;
};

}  // namespace subvol::internal
