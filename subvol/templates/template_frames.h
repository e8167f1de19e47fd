// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/error.h"
#include "subvol/surface/triangle_mesh.h"
#include "subvol/templates/voxel_grid.h"

#include <Eigen/Geometry>

#include <cstddef>
#include <vector>

namespace subvol::internal {

/// Returns orientations in which a grid may suit a surface: the coordinate axes, the principal axes of its area, and a
/// frame of the two perpendicular directions that most of its area faces. Each is a rotation; frames with the same axes
/// are given once.
/// surface  a surface with at least one triangle of non-zero area. Cost: linear in the triangles, plus a sort of the
///          facing directions.
std::vector<Mat3> template_frames(const TriangleMesh& surface);

/// Bounding box of a surface's triangles, in the coordinates of a frame.
Eigen::AlignedBox3d box_in(const Mat3& frame, const TriangleMesh& surface);

/// Number of cells, along each axis, of the grid of cubes around a box; a whole number that may exceed the range of
/// int. On every side the grid has its spare layers.
Eigen::Array3d cells_around(const Eigen::AlignedBox3d& box, double size);

/// Returns the grid of cubes around a box in the coordinates of a frame. `cells_around` must be such that its cells can
/// be numbered.
/// offset  in cubes: how far the grid is shifted toward lower coordinates.
VoxelGrid grid_around(const Mat3& frame, const Eigen::AlignedBox3d& box, double size, const Vec3& offset);

/// Returns the error for a solid around which every grid is too large.
/// cells  number of cells requested in the solid; most: largest number of cells of a grid.
InputError too_sparse(std::size_t cells, double most);

}  // namespace subvol::internal
