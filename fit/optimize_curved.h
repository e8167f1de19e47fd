// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/elements/high_order_mesh.h"
#include "subvol/fit/stages/fit_options.h"
#include "subvol/fit/stages/fit_report.h"
#include "subvol/fit/stages/solve_control.h"
#include "subvol/fit/tuning/tuning.h"
#include "subvol/mesh/volume_mesh.h"

#include <vector>

namespace subvol {

/// Options of `optimize_curved`.
struct CurvedOptimizeOptions {
  /// True: all nodes of the boundary and of interfaces stay; false: those on flat faces move within their planes, and
  /// those on straight borders along them.
  bool fixed_boundary = false;
  double quality = kUsualQuality;  ///< least scaled Jacobian to aim at, in [0, 0.8]; 0: none
  SolveControl control{};
  Tuning tuning{};  ///< for experiments
};

/// The mesh, and how the optimization went.
struct CurvedOptimizeResult {
  HighOrderMesh mesh;              ///< the given mesh with other coefficients; orders and basis are the same
  std::vector<Index> uncertified;  ///< cells that are not certified, ascending
  FitReport report;
};

/// Makes the cells of a curved mesh valid, then well shaped, while its boundary and the interfaces between its regions
/// keep their shape: they are the same polynomials up to rounding, and only flat parts get other coordinates.
///
/// Cells that are not certified are untangled (`untangle`) by the regularized barrier at their quadrature points. Then
/// E_W is minimized with the Hencky barrier, where each cell's ideal box has the cell's present size, and places of
/// poor shape are emphasized more and more, as in high-order fits. A step is kept if it raises the least scaled
/// Jacobian.
///
/// mesh    of hexes, prisms and tets; cells may be inverted.
/// labels  the same cells with their references and groups, whose borders are kept; its positions are not read.
/// returns the last state, or the given mesh, bit for bit, if its cells are all certified and it did not become better:
///         of a higher least scaled Jacobian, or of the same and a higher mean. Unless the work was ended early,
///         report.stop_reason is `stalled` if cells are left that are not certified.
/// InputError: options out of range, pyramids, coefficients that are not finite, other cells in `labels`.
/// Same bits for any number of threads.
CurvedOptimizeResult optimize_curved(const HighOrderMesh& mesh, const VolumeMesh& labels,
                                     const CurvedOptimizeOptions& options);

}  // namespace subvol
