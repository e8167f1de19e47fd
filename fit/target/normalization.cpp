// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/target/normalization.h"

#include "subvol/base/error.h"
#include "subvol/base/format.h"
#include "subvol/fit/geometry/surface_distance.h"
#include "subvol/fit/target/target_surface.h"

#include <Eigen/Geometry>

#include <cmath>
#include <utility>

namespace subvol::internal {

Normalization normalization_of(const TriangleMesh& target) {
  const Vec3 center = TargetSurface::center_of(target);
  const double diagonal = bounding_box_diagonal(target);
  if (!(diagonal > 0) || !std::isfinite(diagonal))
    throw InputError("target: its triangles' bounding box has no extent, or coordinates are not finite");
  return {center, diagonal};
}

Normalization normalization_of(const PointCloud& target) {
  const TargetSurface surface(target);
  return {surface.center(), surface.diagonal()};
}

std::vector<Vec3> Normalization::to_unit(std::vector<Vec3> points) const {
  for (Vec3& p : points) p = (p - center) / diagonal;
  return points;
}

void Normalization::take_in(VolumeMesh& mesh) const {
  // Below this range, cells vanish in the rounding of the target's coordinates; above it, the target in that of cells.
  constexpr double kLeastRelativeSize = 1e-6, kMostRelativeSize = 1e6;
  mesh.positions = to_unit(std::move(mesh.positions));
  Eigen::AlignedBox3d box;
  for (const Index v : mesh.cell_vertices) box.extend(mesh.positions[v]);
  if (box.isEmpty()) return;
  const double size = box.diagonal().stableNorm();
  if (!(size >= kLeastRelativeSize && size <= kMostRelativeSize))
    throw InputError(formatted("the mesh is %.2g times as large as the target; expected one roughly in place", size));
  const double distance = box.center().stableNorm();
  if (!(distance <= kMostRelativeSize))
    throw InputError(formatted(
        "the mesh is %.2g times the target's diagonal away from it; expected one roughly in place", distance));
}

std::vector<Vec3> Normalization::from_unit(std::vector<Vec3> points) const {
  for (Vec3& p : points) p = center + diagonal * p;
  return points;
}

}  // namespace subvol::internal
