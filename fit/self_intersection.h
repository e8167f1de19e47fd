// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/triangle_mesh.h"

#include <array>
#include <vector>

namespace subvol {

/// Where a surface runs through itself.
struct SelfIntersections {
  std::vector<std::array<Index, 2>> pairs;  ///< triangles that meet improperly, smaller number first, ascending
  std::vector<Index> degenerate;            ///< triangles without area (exactly collinear), ascending; in no pair
  bool empty() const { return pairs.empty(); }
};

/// Finds all pairs of triangles that meet in more than their common corners and edge.
///
/// Corners are common when they have the same number, so weld a soup first: triangles that touch in different vertices
/// at the same place count as meeting. Two triangles with a common edge meet improperly when they lie folded onto each
/// other; two with three common corners always do.
///
/// Exact: predicates are evaluated as if without rounding. A quad has no surface of its own here: the answer is one
/// about the triangulation given. InputError: a vertex number out of range, a position that is not finite.
/// Parallel, same answer for any number of threads. Cost: 1 to 3 us a triangle on one
/// core, twice that on flat surfaces, where only exact arithmetic decides.
SelfIntersections self_intersections(const TriangleMesh& mesh);

}  // namespace subvol
