// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface/triangle_mesh.h"
#include "subvol/templates/voxel_grid.h"

#include <array>
#include <vector>

namespace subvol::internal {

/// Cosine between an axis and a triangle's normal above which the triangle counts as perpendicular to the axis: 1.1
/// degrees.
inline constexpr double kAlongAxis = 0.9998;

/// Smallest distance of two lines of a grid, in units of its cells' size, unless something thin lies between them.
inline constexpr double kLeastLineGap = 0.4;

/// Sharp edges of a surface at one position along an axis of a frame, perpendicular to it, and points at which smooth
/// curves of sharp edges come no farther along the axis, such as those of a hole's rim that are closest to a wall.
struct EdgeLevel {
  double position = 0;                        ///< along the axis, length
  double length = 0;                          ///< of all segments
  std::vector<std::array<Vec3, 2>> segments;  ///< in the frame's coordinates
  std::vector<Vec3> turns;                    ///< likewise
};

/// Returns, for each axis of a frame, the levels of the edges at which a surface bends by more than 40 degrees, by
/// increasing position.
///
/// frame      columns: unit axes.
/// tolerance  length, >= 0: edges and turns whose middles differ by less along the axis are one level.
/// InputError: as `welded`. Cost: a sort of the edges.
std::array<std::vector<EdgeLevel>, 3> edge_levels(const TriangleMesh& surface, const Mat3& frame, double tolerance);

/// Adds lines at levels of edges to the lines of a grid along one axis, where a cell could not hold what is between.
///
/// Levels are taken, the longest first, if they are closer than `kLeastLineGap` size to a line that is given, but by at
/// least 1/12 size to all: a chamfer, a ledge or a thin wall then lies between two lines. Their edges must run along
/// others on the given line, closer than 0.6 size, for a quarter of the diagonal and for 4 size at least; or two
/// curves, such as the rims of a hole, must turn that close to edges on the given line that are so long in all.
///
/// diagonal   of the part's bounding box.  tolerance  as for `edge_levels`.
/// size       of the grid's cells, length.
/// lines      positions along the axis, increasing.
void add_lines_at_levels(const std::vector<EdgeLevel>& levels, double diagonal, double tolerance, double size,
                         std::vector<double>& lines);

/// Empties the cells of a grid that are thinner than lines usually are along two axes and neither nearly full nor
/// nearly empty: a chamfer cuts them along their diagonals. Whether half a cell is filled would differ from one to the
/// next. grid  with spare layers (`with_spare_layers`).  fractions  share of each cell that lies in the solid.
void empty_cells_at_chamfers(const VoxelGrid& grid, std::vector<double>& fractions);

}  // namespace subvol::internal
