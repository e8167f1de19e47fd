// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/solver/free_nodes.h"

namespace subvol::internal {

FreeNodes free_nodes(std::span<const std::uint8_t> is_fixed, std::span<const Vec3> positions) {
  FreeNodes result;
  result.fixed.assign(positions.size(), Vec3::Zero());
  for (std::size_t i = 0; i < positions.size(); ++i) {
    if (is_fixed[i]) {
      result.fixed[i] = positions[i];
    } else {
      result.map.columns.push_back(static_cast<Index>(result.unknowns.size()));
      result.map.values.push_back(1);
      result.unknowns.push_back(positions[i]);
    }
    result.map.offsets.push_back(result.map.columns.size());
  }
  result.map.num_cols = result.unknowns.size();
  return result;
}

}  // namespace subvol::internal
