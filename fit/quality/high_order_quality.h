// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/elements/cell_reference.h"
#include "fit/elements/high_order_mesh.h"
#include "fit/quality/quality.h"

namespace subvol {

/// Samples the scaled Jacobian of every curved cell and certifies det J > 0, as `measure_quality` of linear ones does.
///
///   SJ = det F / (|F e1| |F e2| |F e3|),   F = dx/du A^-1,   A: ideal cell, or the reference given
///
/// samples_per_direction  n >= 2, or 0: 2p + 3 for each cell, p its largest order, at least 5: a grid finer than the
///                        quadrature's 2p - 1 points, that has few of them.
/// reference  of each cell, or empty: the ideal cells.
/// returns   as for linear cells; centres of the worst cells are means of their corners.
/// InputError: n < 2, but for 0. Parallel, same bits for any number of threads.
/// Cost at orders 1, 2, 4, 8: a hex about 10 us, 50 us, 1 ms, 30 ms on one core.
QualityReport measure_quality(const HighOrderMesh& mesh, int samples_per_direction = 0,
                              const CellReference& reference = {});

}  // namespace subvol
