// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/optimize_curved.h"
#include "subvol/fit/optimize_mesh.h"
#include "subvol/mesh/volume_mesh.h"

#include <cstddef>

namespace subvol {

// To curve an existing mesh, use it as the template of a high-order fit with kCurvingLambda (`fit_high_order`).

/// Says how the cells of a mesh were changed before a fit.
struct UntangledStart {
  std::size_t tangled = 0;  ///< number of cells that were not certified
  std::size_t left = 0;     ///< number of cells still not certified when the work was ended early
  /// `cancelled` or `time_limit` if ended early; the mesh is then unchanged.
  StopReason stop_reason = StopReason::converged;

  bool ended_early() const { return stop_reason != StopReason::converged; }
};

/// Makes tangled cells of a mesh valid within its own boundary, before the mesh is fitted to a target.
///
/// options  as for `optimize_mesh`; `quality` is taken as 0, because the fit that follows moves all vertices anyway.
/// Does nothing if no cell is tangled. InputError: as `optimize_mesh`, and if cells could not be made valid, with their
/// number and the first of them.
UntangledStart untangle_before_fit(VolumeMesh& mesh, const OptimizeOptions& options);

/// Does the same for curved cells (`optimize_curved`).
UntangledStart untangle_before_fit(HighOrderMesh& mesh, const VolumeMesh& labels, const CurvedOptimizeOptions& options);

}  // namespace subvol
