// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/surface/named_solids.h"

#include "subvol/surface/triangle_geometry.h"
#include "subvol/surface/welded_surface.h"

#include <algorithm>
#include <cmath>

namespace subvol::internal {

namespace {

/// Returns true if each edge has an even number of triangles of each group.
bool are_groups_closed(const TriangleMesh& surface) {
  const std::vector<Index>& of_face = surface.face_groups.of_face;
  bool is_closed = true;
  std::vector<Index> odd;  // groups with an odd number of triangles at an edge so far
  const auto sides = sorted_half_edges(surface.triangles, surface.positions.size());
  for_each_edge(std::span(sides), [&](std::span<const SurfaceHalfEdge> edge) {
    odd.clear();
    for (const SurfaceHalfEdge& side : edge) {
      const auto found = std::ranges::find(odd, of_face[side.triangle]);
      if (found == odd.end())
        odd.push_back(of_face[side.triangle]);
      else
        odd.erase(found);
    }
    is_closed = is_closed && odd.empty();
  });
  return is_closed;
}

}  // namespace

std::vector<double> volumes_of_named_solids(const TriangleMesh& surface) {
  const FaceGroups& groups = surface.face_groups;
  if (groups.groups.size() < 2 || std::ranges::find(groups.of_face, kNoIndex) != groups.of_face.end()) return {};
  std::vector<double> volumes(groups.groups.size(), 0.0), areas(volumes.size(), 0.0);
  std::vector<Index> origins(volumes.size(), kNoIndex);  // a distant one would cost digits
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    const Index g = groups.of_face[t];
    if (origins[g] == kNoIndex) origins[g] = surface.triangles[t][0];
    areas[g] += triangle_area(surface, surface.triangles[t]);
    volumes[g] += sixfold_volume(surface.positions, surface.triangles[t], surface.positions[origins[g]]) / 6;
  }
  std::size_t num_solids = 0;
  for (std::size_t g = 0; g < volumes.size(); ++g) {
    if (origins[g] == kNoIndex) continue;
    if (!(std::abs(volumes[g]) > kRoundingVolumeShare * areas[g] * std::sqrt(areas[g]))) return {};
    ++num_solids;
  }
  return num_solids > 1 && are_groups_closed(surface) ? volumes : std::vector<double>();
}

std::optional<SolidSides> solids_at_sides(const TriangleMesh& mesh, std::span<const std::array<Index, 3>> kept,
                                          std::span<const Index> kept_as) {
  const std::vector<double> volumes = volumes_of_named_solids(mesh);
  if (volumes.empty()) return std::nullopt;
  const auto turned_to_least = [](std::array<Index, 3> t) {
    std::rotate(t.begin(), std::ranges::min_element(t), t.end());
    return t;
  };
  SolidSides solids(kept.size(), {kNoIndex, kNoIndex});
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Index group = mesh.face_groups.of_face[t];
    const bool is_turned = turned_to_least(mesh.triangles[t]) != turned_to_least(kept[kept_as[t]]);
    Index& solid = solids[kept_as[t]][is_turned != (volumes[group] < 0) ? 1 : 0];
    if (solid != kNoIndex && solid != group) return std::nullopt;
    solid = group;
  }
  return solids;
}

}  // namespace subvol::internal
