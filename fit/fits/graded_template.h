// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/fits/local_cells.h"
#include "subvol/fit/geometry/closest_point.h"
#include "subvol/fit/target/target_surface.h"
#include "subvol/surface/triangle_mesh.h"
#include "subvol/templates/search_stop.h"
#include "subvol/templates/voxel_grid.h"

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

namespace subvol::internal {

/// Returns the samples of a target that are farther from a fitted surface than a distance, the farthest first.
/// Cost: a closest point per sample.
std::vector<Vec3> missed_points(const TargetSurface& target, const ClosestPoint& fitted, double distance);

/// Makes a pillowed template whose cells are a third as long around some places (`graded_grid`).
///
/// surface  the boundary of the solid, closed and oriented outward.
/// grid     in its coordinates, with the cells that are kept: those of a template of the solid.
/// places   in the same coordinates, the most important first: as many of the first ones count as there is room for.
/// most_cells  that the result may have.
/// stop     if stopped, the result is nothing.
/// returns  nothing if there is no room for the first places, or no place is in the grid.
/// Cost: up to some twenty of these grids.
std::optional<SizedMesh> graded_template(const TriangleMesh& surface, const VoxelGrid& grid, std::span<const char> kept,
                                         std::span<const Vec3> places, std::size_t most_cells, SearchStop& stop);

}  // namespace subvol::internal
