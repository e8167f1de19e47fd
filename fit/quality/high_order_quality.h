// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/elements/cell_reference.h"
#include "subvol/fit/elements/high_order_mesh.h"
#include "subvol/fit/quality/quality.h"

namespace subvol::internal {

/// Samples the scaled Jacobian of every curved cell and certifies det J > 0, as `measure_quality` does for linear
/// cells.
///
///   SJ = det F / (|F e1| |F e2| |F e3|),   F = dx/du A^-1,   A: ideal cell, or the given reference
///
/// samples_per_direction  n >= 2, or 0: 2p + 3 but at least 5 for each cell, p its largest order: a grid that is finer
///                        than the quadrature's 2p - 1 points and has few of them in common.
/// reference  of each cell; empty: the ideal cells.
/// returns   as for linear cells; the centers of the worst cells are the means of their corners.
/// InputError: n < 2, except 0. Runs in parallel, with the same bits for any number of threads.
/// Cost at orders 1, 2, 4, 8: about 10 us, 50 us, 1 ms, 30 ms per hex on one core.
QualityReport measure_quality(const HighOrderMesh& mesh, int samples_per_direction = 0,
                              const CellReference& reference = {});

}  // namespace subvol::internal
