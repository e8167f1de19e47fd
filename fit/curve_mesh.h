// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/optimize_mesh.h"
#include "subvol/volume_mesh.h"

#include <cstddef>

namespace subvol {

// An existing mesh is curved by a fit of curved elements whose template it is (`fit_high_order`).

/// Weight of the cells' shape for that. Lowering it step by step from what fits start with gets stuck at cells that are
/// nearly flat; starting low gets past them.
inline constexpr double kCurvingLambda = 0.0025;

/// Makes the cells of a mesh valid over its own boundary, where they are not, before it is fitted to a target.
///
/// returns  the number of cells that were not certified; 0: the mesh is as it was.
/// InputError: some could not be made valid, with the first; and as `optimize_mesh`.
std::size_t untangle_before_fit(VolumeMesh& mesh, const OptimizeOptions& options);

}  // namespace subvol
