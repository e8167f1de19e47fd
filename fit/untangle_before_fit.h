// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/optimize_mesh.h"
#include "subvol/mesh/volume_mesh.h"

#include <cstddef>

namespace subvol {

// An existing mesh is curved by a fit of curved elements whose template it is (`fit_high_order`).

/// Weight of the cells' shape for that. Lowering it step by step from what fits start with gets stuck at cells that are
/// nearly flat; starting low gets past them.
inline constexpr double kCurvingLambda = 0.0025;

struct UntangledStart {
  std::size_t tangled = 0;  ///< cells that were not certified
  std::size_t left = 0;     ///< of them, those that were not when the work was ended early
  StopReason stop_reason = StopReason::converged;  ///< cancelled or time_limit where it was: the mesh is as it was then

  bool ended_early() const { return stop_reason != StopReason::converged; }
};

/// Makes the cells of a mesh valid over its own boundary, where they are not, before it is fitted to a target.
///
/// Nothing is done where none is tangled. InputError: some could not be made valid, with the first; and as
/// `optimize_mesh`.
UntangledStart untangle_before_fit(VolumeMesh& mesh, const OptimizeOptions& options);

}  // namespace subvol
