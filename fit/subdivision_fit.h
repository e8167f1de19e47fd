// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/stages/fit_options.h"
#include "subvol/fit/stages/fit_report.h"
#include "subvol/mesh/fit_state.h"
#include "subvol/mesh/volume_mesh.h"
#include "subvol/surface/point_cloud.h"
#include "subvol/surface/triangle_mesh.h"

#include <vector>

namespace subvol {

/// The cage, the finest mesh, and how the fit went.
struct FitResult {
  /// The last control mesh with its tags; its limit surface is the fitted surface. Without cells if the mesh was freed
  /// from it (`FitOptions::frees_mesh`).
  VolumeMesh cage;
  VolumeMesh mesh;  ///< the finest finite element mesh (boundary at limit positions for FittedSurface::limit)
  FitReport report;
  /// Positions of the cage before each minimization that was kept, starting with the template; filled if asked for.
  std::vector<FitState> states;
  int level = 0;  ///< number of times that the template was subdivided for the mesh
};

/// Fits a subdivision volume recursively (paper: section 4.3).
///
/// target         triangles in any state that encloses a volume; the unit of length is the target's.
/// template_mesh  hexes, prisms and tets; must pass `validate` except for unused vertices and should lie roughly at the
///                target's place. Interfaces between its regions (cells of different references) are fitted to those of
///                the target if it has the same regions (`regions_as_in`). Otherwise they keep their shape: they are
///                fitted to themselves, as the boundary is to the target's outer surface, and a warning says so if the
///                target has regions (`matched_target`). If the target is a cloud, they are not held.
/// returns        the best state reached. Every cell of `mesh` is certified (`certificate.h`) unless report.stop_reason
///                is `stalled` or the template has cells that are not certified: no step makes a certified cell lose
///                its certificate.
/// InputError: options out of range, an empty target, a template that cannot be subdivided (pyramids) or that has
/// inverted cells.
FitResult fit_subdivision_volume(const TriangleMesh& target, const VolumeMesh& template_mesh,
                                 const FitOptions& options);

/// Fits a subdivision volume to points: each point attracts the nearest place of the fitted surface (inverse fitting),
/// and all distances are from the points to the surface. In gaps between points, only the cells determine the surface.
///
/// InputError: also for crease_angle_degrees and Correspondence::voronoi, which need triangles.
FitResult fit_subdivision_volume(const PointCloud& target, const VolumeMesh& template_mesh, const FitOptions& options);

}  // namespace subvol
