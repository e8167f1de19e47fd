// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/features/followed_creases.h"
#include "fit/stages/fit_report.h"
#include "subvol/mesh/volume_mesh.h"
#include "subvol/surface/triangle_mesh.h"

#include <functional>
#include <vector>

namespace subvol {

class StageLog;

/// How large cells are to be.
enum class CellSizes {
  uniform,  ///< all alike, with the volume enclosed
  local     ///< as they are: graded meshes stay graded
};

struct OptimizeOptions {
  bool fixed_boundary = false;           ///< boundary vertices stay; otherwise they slide along the surface
  CellSizes sizes = CellSizes::local;
  /// Edges of the surface sharper than this stay sharp, as without a target the creases that the mesh's tags name:
  /// vertices there slide along them. In [0, 180].
  double crease_angle_degrees = kUsualCreaseAngle;
  /// Weight of the cells' shape, > 0: lowered while the boundary is farther from its surface than these distances, in
  /// per cent of the diagonal, > 0.
  double lambda = 0.1;
  double mean_tolerance_percent = 0.05, max_tolerance_percent = 0.5;
  int max_iterations = 0;                ///< per stage; 0: the schedule's own
  double time_limit_seconds = 0;         ///< 0: none
  std::function<bool(const FitProgress&)> progress;  ///< returns false to cancel; empty: none
  std::function<bool()> cancelled;  ///< asked within steps too, from the calling thread; true cancels; empty: none
  StageLog* log = nullptr;               ///< takes the results of minimisations from here and keeps them here; null: no
};

struct OptimizeResult {
  VolumeMesh mesh;                 ///< the mesh given, with other positions
  std::vector<Index> uncertified;  ///< cells that are not proved positive, ascending; empty: all are
  FitReport report;
};

/// Makes the cells of a mesh valid, then well shaped, while its boundary keeps its surface.    Paper: section 4.2
///
/// Cells that are not certified are untangled (`untangle`): with the boundary as it is; where that does not do with its
/// vertices sliding and its sharp edges held; and at last without those sharp edges that touch the cells in question.
/// Then E = E_S + lambda E_W is minimised with the Hencky barrier, as in the fits: no step makes a cell lose its
/// certificate. Between rounds each cell's ideal box takes the proportions the cell has got (for `CellSizes::local`),
/// and its weight becomes the reciprocal of its least scaled Jacobian.
///
/// mesh    must pass `validate` but for inverted cells and unused vertices, else InputError. Vertices where its sharp
///         edges meet (`FollowedCreases`) stay, but for those of cells that are or stay badly shaped.
/// target  what its boundary is to reproduce; null: its boundary as it is.
/// returns the last state. Where cells are left that are not certified, they are listed, and report.stop_reason is
///         `stalled`; where the distances are missed it is `tolerance_missed`.
/// InputError: options out of range, an empty target, a target together with `fixed_boundary`.
/// Same bits for any number of threads.
OptimizeResult optimize_mesh(const VolumeMesh& mesh, const TriangleMesh* target, const OptimizeOptions& options);

}  // namespace subvol
