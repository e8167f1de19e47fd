// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/subdivision/patch_surface.h"

#include <Eigen/Geometry>

namespace subvol {

Vec3 unit_normal(const Vec3& du, const Vec3& dv) {
  // Tangents this close to parallel define no normal: a hundred times the rounding error of their weights.
  constexpr double kParallelTangentSine = 1e-10;
  const Vec3 cross = du.cross(dv);
  const double length = cross.norm();
  return length > kParallelTangentSine * du.norm() * dv.norm() ? Vec3(cross / length) : Vec3(Vec3::Zero());
}

PatchLayout patch_layout(const SurfaceTopology& boundary) {
  PatchLayout layout;
  for (std::size_t i = 0; i < boundary.corner_vertices.size(); ++i) {
    const Index h = static_cast<Index>(i), face = boundary.corner_faces[h];
    const auto is_sharp = [&](Index g) { return boundary.edge_sharpness[boundary.corner_edges[g]] > 0; };
    layout.face_corners.push_back({face, h - boundary.face_offsets[face]});
    layout.sharp_sides.push_back({is_sharp(h), is_sharp(boundary.prev(h))});
  }
  return layout;
}

}  // namespace subvol
