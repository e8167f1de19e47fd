// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/surface/by_number.h"

#include "subvol/mesh/features.h"

#include <algorithm>
#include <map>
#include <utility>
#include <vector>

namespace subvol::internal {

FeatureTags tags_by_number(const FeatureTags& tags, const PolygonMesh& surface, std::span<const Index> vertex_numbers) {
  std::map<std::pair<Index, Index>, double> creases;
  for (const CreaseEdge& crease : tags.creases) creases[std::minmax(crease.v0, crease.v1)] = crease.sharpness;
  std::map<Index, double> corners;
  for (const CornerVertex& corner : tags.corners) corners[corner.vertex] = corner.sharpness;
  FeatureTags result;
  for (std::size_t f = 0; f < surface.num_faces() && !creases.empty(); ++f) {
    const auto face = surface.face(f);
    for (std::size_t k = 0; k < face.size(); ++k) {
      const Index a = face[k], b = face[(k + 1) % face.size()];
      const auto found = creases.find(std::minmax(vertex_numbers[a], vertex_numbers[b]));
      if (found != creases.end()) result.creases.push_back({a, b, found->second});
    }
  }
  for (std::size_t v = 0; v < vertex_numbers.size() && !corners.empty(); ++v)
    if (const auto found = corners.find(vertex_numbers[v]); found != corners.end())
      result.corners.push_back({static_cast<Index>(v), found->second});
  return merge_tags(result, {});
}

FaceGroups groups_by_number(const FaceGroups& groups, std::span<const Index> face_numbers) {
  FaceGroups result;
  std::vector<char> has_face(groups.groups.size(), 0), had_face(groups.groups.size(), 0);
  for (const Index group : groups.of_face)
    if (group != kNoIndex) had_face[group] = 1;
  if (!groups.empty())
    for (const Index f : face_numbers)
      if (groups.of_face[f] != kNoIndex) has_face[groups.of_face[f]] = 1;
  std::vector<Index> place(groups.groups.size(), kNoIndex);
  for (std::size_t g = 0; g < place.size(); ++g) {
    if (had_face[g] && !has_face[g]) continue;
    place[g] = static_cast<Index>(result.groups.size());
    result.groups.push_back(groups.groups[g]);
  }
  if (result.groups.empty()) return result;
  for (const Index f : face_numbers)
    result.of_face.push_back(groups.of_face[f] == kNoIndex ? kNoIndex : place[groups.of_face[f]]);
  return result;
}

}  // namespace subvol::internal
