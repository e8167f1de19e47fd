// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/geometry/grouped_closest_point.h"

#include "subvol/base/error.h"

#include <algorithm>
#include <utility>

namespace subvol::internal {

GroupedClosestPoint::GroupedClosestPoint(const TriangleMesh& mesh, std::span<const Index> groups)
    : all_(mesh), group_(groups.begin(), groups.end()), place_(groups.size()), is_one_(groups.empty()) {
  if (is_one_) return;
  if (groups.size() != mesh.triangles.size())
    throw InputError("GroupedClosestPoint: one group is expected for each triangle");
  triangles_.resize(*std::max_element(groups.begin(), groups.end()) + 1);
  for (std::size_t t = 0; t < groups.size(); ++t) {
    place_[t] = static_cast<Index>(triangles_[groups[t]].size());
    triangles_[groups[t]].push_back(static_cast<Index>(t));
  }
  TriangleMesh part{mesh.positions, {}};
  for (const std::vector<Index>& of_group : triangles_) {
    part.triangles.clear();
    for (const Index t : of_group) part.triangles.push_back(mesh.triangles[t]);
    of_group.empty() ? trees_.emplace_back() : trees_.emplace_back(std::in_place, part);
  }
}

void GroupedClosestPoint::move(std::span<const Vec3> positions) {
  all_.move(positions);
  for (std::optional<ClosestPoint>& tree : trees_)
    if (tree) tree->move(positions);
}

ClosestPoint::Hit GroupedClosestPoint::closest(const Vec3& p, Index group, Index hint) const {
  const bool has_tree = static_cast<std::size_t>(group) < trees_.size() && trees_[group];
  if (!has_tree) return all_.closest(p, hint);
  const bool helps = hint != kNoIndex && group_[hint] == group;
  ClosestPoint::Hit hit = trees_[group]->closest(p, helps ? place_[hint] : kNoIndex);
  if (hit.triangle != kNoIndex) hit.triangle = triangles_[group][hit.triangle];
  return hit;
}

void GroupedClosestPoint::closest(std::span<const Vec3> points, std::span<const Index> groups,
                                  std::span<ClosestPoint::Hit> hits) const {
  if (is_one_) {
    all_.closest(points, hits);
    return;
  }
  if (points.size() != hits.size() || groups.size() != points.size())
    throw InputError("GroupedClosestPoint: as many groups and hits are expected as points");
#pragma omp parallel for schedule(dynamic, 256)
  for (std::size_t i = 0; i < points.size(); ++i) hits[i] = closest(points[i], groups[i], hits[i].triangle);
}

}  // namespace subvol::internal
