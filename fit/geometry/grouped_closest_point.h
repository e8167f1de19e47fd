// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/geometry/closest_point.h"

#include <optional>
#include <span>
#include <vector>

namespace subvol::internal {

/// Finds closest points on those triangles of a mesh that belong to a group: one tree for each group, and one for all.
///
/// Where a sharp edge is near, the closest point of the whole surface may lie on the wrong side of it; the closest
/// point of the group does not.
class GroupedClosestPoint {
 public:
  /// groups  group of each triangle, from 0 on; empty: all in group 0. InputError: another number of groups than of
  ///         triangles, and as `ClosestPoint`. Cost: twice that of `ClosestPoint`.
  explicit GroupedClosestPoint(const TriangleMesh& mesh, std::span<const Index> groups = {});

  /// As `ClosestPoint::order`.
  std::span<const Index> order() const { return all_.order(); }

  /// As `ClosestPoint::move`.
  void move(std::span<const Vec3> positions);

  /// As `ClosestPoint::closest`, on the triangles of a group; on all of them if the group has none, or is kNoIndex.
  /// Triangles of hints and hits are numbered as in the mesh; a hint from another group is ignored.
  ClosestPoint::Hit closest(const Vec3& p, Index group, Index hint = kNoIndex) const;
  /// Does the same for many points, in parallel. `groups` holds the group of each point; if it is empty, all points are
  /// in group 0. Hits are as for `ClosestPoint::closest`.
  void closest(std::span<const Vec3> points, std::span<const Index> groups, std::span<ClosestPoint::Hit> hits) const;

 private:
  ClosestPoint all_;
  std::vector<std::optional<ClosestPoint>> trees_;  // of each group; none: a group without triangles, or no groups
  std::vector<std::vector<Index>> triangles_;       // of each tree, as the mesh numbers them
  std::vector<Index> group_, place_;                // of each triangle: its group, its number in the group's tree
  bool is_one_;                                     // all triangles are in one group
};

}  // namespace subvol::internal
