// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface/triangle_mesh.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace subvol::internal {

/// The places where a surface intersects itself.
struct SelfIntersections {
  std::vector<std::array<Index, 2>> pairs;  ///< triangles that meet improperly, smaller number first, ascending
  std::vector<Index> degenerate;            ///< triangles without area (exactly collinear), ascending; not in any pair
  bool is_complete = true;                  ///< false: cancelled, or there are more than `kMostIntersectingPairs`
  bool empty() const { return pairs.empty(); }
};

/// Largest number of pairs that a search returns; it ends early if there are more.
inline constexpr std::size_t kMostIntersectingPairs = 1'000'000;

/// Finds all pairs of triangles that meet in more than their common corners and edge.
///
/// Corners are common if they have the same number, so weld a soup first: triangles that touch in different vertices at
/// the same place count as meeting. Two triangles with a common edge meet improperly if they are folded onto each
/// other; two with three common corners always do.
///
/// The result is exact: predicates are evaluated as if without rounding. A quad has no surface of its own here; the
/// result is that of the given triangulation. InputError: a vertex number out of range, a position that is not finite.
/// cancelled  asked now and then, from the calling thread; if it returns true, the search ends with the pairs found so
///            far. Empty: never.
/// Runs in parallel; the result is the same for any number of threads. Cost: 1 to 3 us a triangle on one core, twice
/// that on flat surfaces, where only exact arithmetic decides. The cost is quadratic in the triangles around one vertex
/// (8,000 around each of two: 5 s) and in triangles in a heap, all of whose boxes meet. Memory: that of the result.
///
/// marked  one entry per triangle: only pairs with a triangle whose entry is not 0 are found; the others cost little
///         more than their boxes. Empty: all pairs.
SelfIntersections self_intersections(const TriangleMesh& mesh, const std::function<bool()>& cancelled = {},
                                     std::span<const std::uint8_t> marked = {});

/// Returns the number of pairs, or `kMostIntersectingPairs` if the search was cancelled.
std::size_t count_intersecting_pairs(const TriangleMesh& mesh, const std::function<bool()>& cancelled = {});

}  // namespace subvol::internal
