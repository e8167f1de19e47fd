// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface/triangle_mesh.h"
#include "subvol/templates/voxel_grid.h"

#include <vector>

namespace subvol {

/// Share of each cell of a grid that lies inside a closed, oriented surface.
///
///   f(cell) = mean over n x n lines through the cell, along its third edge, of the share of the line with w(x) > 0
///
/// w(x) is the number of times the surface winds around x: crossings along the line, counted by the side they are
/// crossed from. Two triangles decide about their common edge by the same number, so a line crosses exactly one of
/// them.
///
/// surface  closed: every edge as often in one direction as in the other; normals point outward. Where it is not closed
///          a line may end inside; such lines do not count.
/// num_lines  n >= 1, by cell and direction.
/// returns  one number in [0, 1] per cell.
/// Cost: linear in triangles and lines. Serial.
std::vector<double> solid_fractions(const TriangleMesh& surface, const VoxelGrid& grid, int num_lines = 4);

}  // namespace subvol
