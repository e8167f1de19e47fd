// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface/triangle_mesh.h"

#include <cstddef>
#include <span>
#include <vector>

namespace subvol::internal {

/// A triangle across an edge of another one.
struct TriangleNeighbor {
  Index triangle = kNoIndex;
  bool disagrees = false;  ///< true if both triangles run the same way along their common edge
};

/// The parts of a surface whose triangles were turned to agree.
struct OrientedParts {
  std::vector<int> part;          ///< of each triangle, numbered by the first one; -1 for a triangle without neighbors
  std::size_t turned = 0;         ///< triangles
  Index not_oriented = kNoIndex;  ///< a triangle of the first part that cannot be oriented, if there is one
};

/// Turns triangles that disagree with their part about the outside: the majority of a part stays as it is. A part that
/// cannot be oriented stays as it is.
///
/// neighbors  of each triangle. Cost: linear.
OrientedParts orient_parts(TriangleMesh& mesh, std::span<const std::vector<TriangleNeighbor>> neighbors);

}  // namespace subvol::internal
