// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/surface/region_names.h"

#include "subvol/surface/triangle_geometry.h"

#include <map>
#include <string>
#include <utility>

namespace subvol::internal {

void name_regions_by_groups(RegionSurface& surface) {
  constexpr double kLeastGroupShare = 0.5;       // of a region's area
  constexpr double kWholeGroupShare = 1 - 1e-9;  // of a group's area, up to rounding
  const auto& groups = surface.mesh.face_groups;
  if (groups.empty()) return;
  std::vector<double> of_group(groups.groups.size(), 0.0), of_region(surface.regions.size(), 0.0);
  std::map<std::pair<Index, std::size_t>, double> shared;  // by group and region
  for (std::size_t t = 0; t < surface.sides.size(); ++t) {
    const Index g = groups.of_face[t];
    const double one = triangle_area(surface.mesh, surface.mesh.triangles[t]);
    if (g != kNoIndex) of_group[g] += one;
    for (const int side : surface.sides[t]) {
      if (side == kOutsideRegion) continue;
      const auto r = static_cast<std::size_t>(side - 1);  // they are numbered from 1 on
      of_region[r] += one;
      if (g != kNoIndex) shared[{g, r}] += one;
    }
  }
  Index named = kNoIndex;  // the last group whose name was given
  for (const auto& [key, area] : shared) {
    const auto& [g, r] = key;
    std::string& name = surface.regions[r].name;
    if (g == named || !name.empty() || !(of_group[g] > 0)) continue;
    if (area < kWholeGroupShare * of_group[g] || of_group[g] < kLeastGroupShare * of_region[r]) continue;
    name = groups.groups[g].name;
    named = g;
  }
}

}  // namespace subvol::internal
