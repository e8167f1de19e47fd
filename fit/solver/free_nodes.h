// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"
#include "subvol/subdivision/sparse_map.h"

#include <cstdint>
#include <span>
#include <vector>

namespace subvol {

/// Nodes of a mesh of which some stay: y = M x + y0 (`FitProblem`), x being those that may move.
struct FreeNodes {
  SparseMap map;                ///< M
  std::vector<Vec3> fixed;      ///< y0: the positions of those that stay, else 0
  std::vector<Vec3> unknowns;   ///< x: the positions of the others, in their order
};

/// is_fixed, positions: one entry per node.
FreeNodes free_nodes(std::span<const std::uint8_t> is_fixed, std::span<const Vec3> positions);

}  // namespace subvol
