// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface/label_grid.h"
#include "subvol/surface/region_surface.h"

#include <cstddef>
#include <functional>

namespace subvol {

/// Options of `surface_of_labels`.
struct LabelSurfaceOptions {
  int rounds = 30;                ///< of smoothing, >= 0; 0: the voxels' own faces
  std::size_t least_voxels = 20;  ///< smaller connected components are given to what is around them
  /// Asked about 20 times a second; returns true to cancel. Empty: never.
  std::function<bool()> cancelled;
};

/// Returns the surfaces between the regions of a segmentation, with the staircase of its voxels smoothed.
///
/// First the labels of single voxels are changed where regions touch along an edge or at a corner alone, so that each
/// region's boundary is a manifold, and specks are removed. The faces between voxels of different labels are the
/// sheets. Their vertices are averaged over neighbors on the sheet, and along the curve where three sheets or more
/// meet, forth and back (Taubin, "A signal processing approach to fair surface design", 1995), at most a voxel away
/// from where they were. Then each sheet moves along its normals until every region has the volume of its voxels, up to
/// about 0.01 %.
///
/// returns  regions numbered by their labels; only one if the segmentation has no other; none if cancelled. Faces at
///          the border of the grid are part of the outer surface.
/// InputError: not one label for each voxel; no voxel has a label above 0; a region has only specks, or less than a
/// speck and less than half of it are left where it touches itself or others along an edge or at a corner alone.
/// Serial. Cost: about a second for a million voxels and a hundred thousand faces.
RegionSurface surface_of_labels(const LabelGrid& grid, const LabelSurfaceOptions& options = {});

}  // namespace subvol
