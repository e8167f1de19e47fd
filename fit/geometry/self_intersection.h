// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface/triangle_mesh.h"

#include <array>
#include <cstddef>
#include <functional>
#include <vector>

namespace subvol {

/// Where a surface runs through itself.
struct SelfIntersections {
  std::vector<std::array<Index, 2>> pairs;  ///< triangles that meet improperly, smaller number first, ascending
  std::vector<Index> degenerate;            ///< triangles without area (exactly collinear), ascending; in no pair
  bool is_complete = true;                  ///< false: cancelled, or `kMostIntersectingPairs` were found
  bool empty() const { return pairs.empty(); }
};

/// The search ends with so many pairs; there may be more.
inline constexpr std::size_t kMostIntersectingPairs = 1'000'000;

/// Finds all pairs of triangles that meet in more than their common corners and edge.
///
/// Corners are common when they have the same number, so weld a soup first: triangles that touch in different vertices
/// at the same place count as meeting. Two triangles with a common edge meet improperly when they lie folded onto each
/// other; two with three common corners always do.
///
/// Exact: predicates are evaluated as if without rounding. A quad has no surface of its own here: the answer is one
/// about the triangulation given. InputError: a vertex number out of range, a position that is not finite.
/// cancelled  asked now and then, from the calling thread; true ends the search with what was found; empty: none.
/// Parallel, same answer for any number of threads. Cost: 1 to 3 us a triangle on one core, twice that on flat
/// surfaces, where only exact arithmetic decides. It is quadratic in the triangles around one vertex (8,000 around each
/// of two: 5 s) and in those that lie in a heap, whose boxes all meet. Memory: that of the answer.
SelfIntersections self_intersections(const TriangleMesh& mesh, const std::function<bool()>& cancelled = {});

/// The number of pairs; `kMostIntersectingPairs` where the search was cancelled.
std::size_t count_intersecting_pairs(const TriangleMesh& mesh, const std::function<bool()>& cancelled = {});

}  // namespace subvol
