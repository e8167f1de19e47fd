// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/surface/orientation.h"

#include <algorithm>
#include <utility>

namespace subvol::internal {

OrientedParts orient_parts(TriangleMesh& mesh, std::span<const std::vector<TriangleNeighbor>> neighbors) {
  OrientedParts result;
  result.part.assign(mesh.triangles.size(), -1);
  std::vector<char> turned(mesh.triangles.size(), 0);
  std::vector<Index> members;
  int count = 0;
  for (std::size_t seed = 0; seed < mesh.triangles.size(); ++seed) {
    if (result.part[seed] >= 0 || neighbors[seed].empty()) continue;
    members.assign(1, static_cast<Index>(seed));
    result.part[seed] = count;
    Index not_oriented = kNoIndex;
    for (std::size_t i = 0; i < members.size(); ++i) {
      const Index t = members[i];
      for (const TriangleNeighbor& neighbor : neighbors[t]) {
        const Index other = neighbor.triangle;
        const char wanted = static_cast<char>((turned[t] != 0) != neighbor.disagrees);
        if (result.part[other] < 0) {
          result.part[other] = count;
          turned[other] = wanted;
          members.push_back(other);
        } else if (turned[other] != wanted && not_oriented == kNoIndex) {
          not_oriented = other;
        }
      }
    }
    ++count;
    if (not_oriented != kNoIndex) {
      if (result.not_oriented == kNoIndex) result.not_oriented = not_oriented;
      continue;
    }
    const auto num_turned = static_cast<std::size_t>(
        std::count_if(members.begin(), members.end(), [&](Index t) { return turned[t] != 0; }));
    const bool is_majority = 2 * num_turned > members.size();
    for (const Index t : members)
      if ((turned[t] != 0) != is_majority) {
        std::swap(mesh.triangles[t][1], mesh.triangles[t][2]);
        ++result.turned;
      }
  }
  return result;
}

}  // namespace subvol::internal
