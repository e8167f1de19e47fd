// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/export/export.h"

#include <span>

namespace subvol {

/// Selects the cells to remove so that the inside becomes visible: those whose center lies beyond a plane perpendicular
/// to an axis.
struct CutPlane {
  static constexpr int kShortest = -1;
  int axis = kShortest;  ///< 0, 1, 2, or the axis along which the mesh is shortest, which gives the largest section
  double share = 0.5;    ///< position between the lowest and the highest cell center, in (0, 1)
};

/// The inside of a mesh: its cells up to a plane, as whole cells, colored by their quality.
///
/// Nodes: "surface" (what remains of the boundary, shaded smoothly; a vertex has the least quality around it), "cut"
/// (the faces that the removed cells uncover, each separate and in the color of its own cell) and "wireframe" (the
/// edges of both). Each side of a curved face is cut into 2 * (largest order) intervals, at least four.
///
/// cell_minima  one scaled Jacobian per cell.
/// InputError: no cells; a wrong number of minima; an axis or share out of range. A mesh of one layer stays whole.
Scene cutaway_scene(const VolumeMesh& mesh, std::span<const double> cell_minima, const CutPlane& plane = {},
                    const SurfaceSceneOptions& options = {});
Scene cutaway_scene(const HighOrderMesh& mesh, std::span<const double> cell_minima, const CutPlane& plane = {},
                    const SurfaceSceneOptions& options = {});

}  // namespace subvol
