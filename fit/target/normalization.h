// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"
#include "subvol/mesh/volume_mesh.h"
#include "subvol/surface/point_cloud.h"
#include "subvol/surface/triangle_mesh.h"

#include <vector>

namespace subvol::internal {

/// Centered coordinates in which a surface's bounding box has the diagonal 1, so that results do not depend on the
/// origin or the unit.
struct Normalization {
  Vec3 center = Vec3::Zero();
  double diagonal = 1;

  std::vector<Vec3> to_unit(std::vector<Vec3> points) const;
  std::vector<Vec3> from_unit(std::vector<Vec3> points) const;
  /// Transforms a mesh to the coordinates of a target. InputError: the mesh is more than 1e6 times smaller or larger
  /// than the target, or more than 1e6 diagonals away from it.
  void take_in(VolumeMesh& mesh) const;
};

/// Returns the coordinates of a fit. InputError: a target without extent, or with coordinates that are not finite.
Normalization normalization_of(const TriangleMesh& target);
Normalization normalization_of(const PointCloud& target);

}  // namespace subvol::internal
