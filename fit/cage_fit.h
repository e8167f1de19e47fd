// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/stages/fit_options.h"
#include "subvol/fit/subdivision_fit.h"
#include "subvol/fit/target/fit_target.h"
#include "subvol/mesh/volume_mesh.h"

namespace subvol::internal {

/// A fit whose degrees of freedom are the vertices of a cage.
struct CageFit {
  FitResult result;
  /// The finest mesh with lifted cells, if its surface was too far off for the cage. If its vertices are freed, they
  /// come back to the surface. Without cells if there is none, or if `FitOptions::frees_mesh` is not set.
  VolumeMesh lifted;
};

/// Fits the cage of each level in turn (paper: section 4.3), and raises the quality of the finest mesh as far as the
/// cage allows.
///
/// options        as for `fit_subdivision_volume`, which states the errors.
/// levels_before  number of levels of the fit whose mesh is the template; the report counts levels from there.
///                If it is positive and memory runs out in the first level, the result has no cells.
CageFit fit_cage(FitTarget target, const VolumeMesh& template_mesh, const FitOptions& options, int levels_before = 0);

}  // namespace subvol::internal
