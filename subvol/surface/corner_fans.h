// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/disjoint_sets.h"
#include "subvol/surface/welded_surface.h"

#include <array>
#include <cstddef>
#include <span>

namespace subvol::internal {

/// Fans of triangles around vertices: the corners at one vertex of triangles that are joined across edges there. A
/// manifold surface has one fan at each vertex. Corner k of triangle t has the number 3 t + k.
class CornerFans {
 public:
  /// triangles  must outlive this. Each corner begins as a fan of its own.
  explicit CornerFans(std::span<const std::array<Index, 3>> triangles)
      : triangles_(triangles), sets_(3 * triangles.size()) {}

  /// Joins the corners of two triangles at both ends of an edge that they share.
  void join(const SurfaceHalfEdge& a, const SurfaceHalfEdge& b) {
    for (const Index v : {a.low, a.high}) sets_.join(corner(a.triangle, v), corner(b.triangle, v));
  }
  std::size_t num_corners() const { return sets_.size(); }
  /// Returns the least corner of the fan that a corner belongs to.
  Index of(std::size_t corner) { return sets_.of(static_cast<Index>(corner)); }

 private:
  Index corner(Index t, Index v) const {
    const auto& corners = triangles_[t];
    return static_cast<Index>(3 * t + (corners[0] == v ? 0 : corners[1] == v ? 1 : 2));
  }

  std::span<const std::array<Index, 3>> triangles_;
  DisjointSets sets_;
};

}  // namespace subvol::internal
