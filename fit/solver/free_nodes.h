// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"
#include "subvol/subdivision/sparse_map.h"

#include <cstdint>
#include <span>
#include <vector>

namespace subvol::internal {

/// Nodes of a mesh, some of which are fixed: y = M x + y0 (`FitProblem`), where x holds the free ones.
struct FreeNodes {
  SparseMap map;               ///< M
  std::vector<Vec3> fixed;     ///< y0: the positions of fixed nodes, 0 for free ones
  std::vector<Vec3> unknowns;  ///< x: the positions of the free nodes, in their order
};

/// Separates fixed from free nodes. is_fixed, positions: one entry per node.
FreeNodes free_nodes(std::span<const std::uint8_t> is_fixed, std::span<const Vec3> positions);

}  // namespace subvol::internal
