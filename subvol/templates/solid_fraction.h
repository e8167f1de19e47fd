// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface/triangle_mesh.h"
#include "subvol/templates/search_stop.h"
#include "subvol/templates/voxel_grid.h"

#include <vector>

namespace subvol::internal {

/// Computes the share of each cell of a grid that lies inside a closed, oriented surface.
///
///   f(cell) = mean over n x n lines through the cell, along its third edge, of the share of the line with w(x) > 0
///
/// w(x) is the number of times the surface winds around x: the signed sum of the crossings along the line up to x. Both
/// triangles at an edge decide on which side of it a line passes by the same number, so a line near the edge crosses
/// exactly one of them. The lines of a cell are equally spaced between the grid's own.
///
/// surface    closed: every edge occurs as often in one direction as in the other; normals point outward. If the
///            surface is not closed, a line may end inside; such lines contribute nothing.
/// grid       equal cells, or those between given lines (`VoxelGrid::lines`).
/// num_lines  n >= 1, lines per cell along each of its first two edges.
/// stop       if given and stopped, the work ends early; the numbers then mean nothing.
/// returns    one number in [0, 1] per cell.
/// Cost: linear in the numbers of triangles and lines. Serial.
std::vector<double> solid_fractions(const TriangleMesh& surface, const VoxelGrid& grid, int num_lines = 4,
                                    SearchStop* stop = nullptr);

}  // namespace subvol::internal
