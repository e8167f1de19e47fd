// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/mending/fins.h"

#include "subvol/surface/surface_parts.h"
#include "subvol/surface/triangle_geometry.h"

#include <algorithm>
#include <vector>

namespace subvol::internal {

std::optional<SurfaceWithoutFins> without_fins(const TriangleMesh& surface) {
  const SurfaceParts parts = surface_parts(surface);
  const TriangleMesh& mesh = parts.surface.mesh;
  std::vector<char> has_rim(parts.num_parts(), 0), is_fin(parts.num_parts(), 0);
  for (const std::size_t side : parts.rims) has_rim[parts.part[parts.sides[side].triangle]] = 1;
  for (const std::size_t first : parts.crowded)
    for (const SurfaceHalfEdge& side : parts.edge(first))
      is_fin[parts.part[side.triangle]] = has_rim[parts.part[side.triangle]];
  if (std::ranges::find(is_fin, 0) == is_fin.end() || std::ranges::find(is_fin, 1) == is_fin.end()) return std::nullopt;
  SurfaceWithoutFins result;
  result.surface.positions = mesh.positions;
  result.surface.face_groups.groups = mesh.face_groups.groups;
  double all = 0, dropped = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const double area = doubled_area_vector(mesh, mesh.triangles[t]).norm();
    all += area;
    if (is_fin[parts.part[t]]) {
      dropped += area;
      ++result.triangles;
      continue;
    }
    result.surface.triangles.push_back(mesh.triangles[t]);
    if (!mesh.face_groups.empty()) result.surface.face_groups.of_face.push_back(mesh.face_groups.of_face[t]);
  }
  result.area_share = all > 0 ? dropped / all : 0;
  return result;
}

}  // namespace subvol::internal
