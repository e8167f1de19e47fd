// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "export/export.h"

#include <span>

namespace subvol {

/// What is taken off a mesh to show the cells inside: those whose centre is beyond a plane across an axis.
struct CutPlane {
  static constexpr int kShortest = -1;
  int axis = kShortest;  ///< 0, 1, 2, or the one along which the mesh is shortest: the largest section
  double share = 0.5;    ///< where it stands between the lowest and the highest of the cells' centres; in (0, 1)
};

/// What a mesh is like inside: its cells up to a plane, whole ones, coloured by their quality.
///
/// Nodes: "surface" (what is left of the boundary, shaded smoothly; a vertex has the least quality around), "cut" (the
/// faces of cells that were taken off, each by itself and of its own cell's colour) and "wireframe" (the edges
/// of both). Curved faces are cut into quads, two to an interval of the order and four at least.
///
/// cell_minima  one scaled Jacobian per cell.
/// InputError: no cells; minima of another number; an axis or share out of range. A mesh of one layer stays whole.
Scene cutaway_scene(const VolumeMesh& mesh, std::span<const double> cell_minima, const CutPlane& plane = {},
                    const SurfaceSceneOptions& options = {});
Scene cutaway_scene(const HighOrderMesh& mesh, std::span<const double> cell_minima, const CutPlane& plane = {},
                    const SurfaceSceneOptions& options = {});

}  // namespace subvol
