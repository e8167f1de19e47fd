// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/export/export.h"

#include <span>
#include <vector>

namespace subvol {

/// Selects the cells to remove so that the inside becomes visible: those whose center lies beyond a plane perpendicular
/// to an axis.
struct CutPlane {
  static constexpr int kShortestAxis = -1;  ///< stands for the axis along which the mesh is shortest
  int axis = kShortestAxis;                 ///< 0, 1, 2, or kShortestAxis, which gives the largest section
  double share = 0.5;                       ///< position between the lowest and the highest cell center, in (0, 1)
};

/// The regions of a mesh's cells. With at most one, scenes do not show them.
struct CellRegions {
  std::vector<Group> regions;  ///< their names and numbers
  std::vector<Index> of_cell;  ///< for each cell a place in `regions`
};

/// Returns a scene of the inside of a mesh: its cells up to a plane, as whole cells, colored by their quality, or by
/// region if there are several.
///
/// Nodes: "surface" (what remains of the boundary, shaded smoothly; a vertex has the least quality around it), "cut"
/// (the faces that the removed cells uncover, each separate and in the color of its own cell) and "wireframe" (the
/// edges of both). Each side of a curved face is cut into 2 * (largest order) intervals, at least four. Each of several
/// regions is a part of "surface" and "cut" with a material that bears its name; _SCALED_JACOBIAN is there all the
/// same.
///
/// cell_minima  one scaled Jacobian per cell.
/// InputError: no cells; a wrong number of minima or regions; an axis or share out of range. A mesh of one layer stays
/// whole.
Scene cutaway_scene(const VolumeMesh& mesh, std::span<const double> cell_minima, const CutPlane& plane = {},
                    const SurfaceSceneOptions& options = {}, const CellRegions& regions = {});
Scene cutaway_scene(const HighOrderMesh& mesh, std::span<const double> cell_minima, const CutPlane& plane = {},
                    const SurfaceSceneOptions& options = {}, const CellRegions& regions = {});

}  // namespace subvol
