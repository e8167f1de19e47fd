// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/mending/second_sides.h"

#include "subvol/surface/welded_surface.h"

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

namespace subvol::internal {

namespace {

/// A triangle with its smallest corner first and the smaller one of the others next.
struct SortedTriangle {
  std::array<Index, 3> corners;
  bool is_turned;  ///< the corners are in the other cyclic order than in the surface
  Index triangle;
};

SortedTriangle sorted(std::array<Index, 3> corners, Index triangle) {
  std::rotate(corners.begin(), std::ranges::min_element(corners), corners.end());
  const bool is_turned = corners[1] > corners[2];
  if (is_turned) std::swap(corners[1], corners[2]);
  return {corners, is_turned, triangle};
}

}  // namespace

std::optional<OneSidedSurface> without_second_sides(const TriangleMesh& surface) {
  constexpr double kLeastTwoSidedShare = 0.9;  // of the triangles
  const TriangleMesh mesh = welded(surface).mesh;
  std::vector<SortedTriangle> all;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    all.push_back(sorted(mesh.triangles[t], static_cast<Index>(t)));
  std::ranges::sort(all, [](const SortedTriangle& a, const SortedTriangle& b) {
    return a.corners != b.corners ? a.corners < b.corners : a.triangle < b.triangle;
  });
  std::vector<char> is_second(mesh.triangles.size(), 0);
  std::size_t dropped = 0;
  for (std::size_t first = 0; first + 1 < all.size(); ++first) {
    if (all[first].corners != all[first + 1].corners || all[first].is_turned == all[first + 1].is_turned) continue;
    is_second[all[++first].triangle] = 1;
    ++dropped;
  }
  if (2 * static_cast<double>(dropped) < kLeastTwoSidedShare * static_cast<double>(mesh.triangles.size()) ||
      dropped == 0)
    return std::nullopt;
  OneSidedSurface result{.dropped = dropped};
  result.surface.positions = mesh.positions;
  result.surface.face_groups.groups = mesh.face_groups.groups;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (is_second[t]) continue;
    result.surface.triangles.push_back(mesh.triangles[t]);
    if (!mesh.face_groups.empty()) result.surface.face_groups.of_face.push_back(mesh.face_groups.of_face[t]);
  }
  return result;
}

}  // namespace subvol::internal
