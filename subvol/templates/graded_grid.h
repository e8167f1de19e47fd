// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/mesh/volume_mesh.h"
#include "subvol/surface/triangle_mesh.h"
#include "subvol/templates/search_stop.h"
#include "subvol/templates/voxel_grid.h"

#include <span>
#include <vector>

namespace subvol::internal {

/// Cells carved from a grid of which some cells are cut in 27.
struct GradedGrid {
  VolumeMesh mesh;            ///< hexes; no others use its vertices
  std::vector<double> sizes;  ///< for each cell, the length of its edges beside that of a cell of the grid, in (0, 1]
};

/// Cuts cells of a carved grid in 27 and carves the small ones anew: each is kept if at least half of it is inside the
/// surface, as far as the topology of the whole allows (`evolve`, `reach_thin_parts`). So a slot that is narrower than
/// a cell of the grid is opened, and a thin finger gets cells.
///
/// Cells around those that are cut are divided so that the mesh conforms (`refine_locally`); cells that come to be cut
/// in 27 by that are carved anew as well. All others stay as they are.
///
/// surface  the boundary of the solid: closed, oriented outward (`solid_fractions`).
/// kept     one entry per cell of the grid, non-zero for the cells to keep: all points are good by
///          `VertexRule::pillowable`, and so they are in the result. None on the grid's outer layer.
/// cut      one entry per cell, non-zero for those to cut, filled or empty. Those on the outer layer stay whole.
/// stop     if stopped, the work ends early; the result then means nothing. May be null.
/// Deterministic, serial. Cost: one refinement, and an evolution (`voxel_evolution.h`) per connected set of cut cells,
/// on the box around it.
GradedGrid graded_grid(const TriangleMesh& surface, const VoxelGrid& grid, std::span<const char> kept,
                       std::span<const char> cut, SearchStop* stop = nullptr);

/// Marks the cells of a grid that hold a point, and those that touch them.
/// returns  one entry per cell, non-zero for marked ones; points outside the grid mark nothing.
std::vector<char> cells_around_points(const VoxelGrid& grid, std::span<const Vec3> points);

}  // namespace subvol::internal
