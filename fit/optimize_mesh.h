// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/features/feature_curves.h"
#include "subvol/fit/stages/fit_options.h"
#include "subvol/fit/stages/fit_report.h"
#include "subvol/fit/stages/solve_control.h"
#include "subvol/fit/tuning/tuning.h"
#include "subvol/mesh/volume_mesh.h"
#include "subvol/surface/triangle_mesh.h"

#include <vector>

namespace subvol {

/// Wanted sizes of the cells.
enum class CellSizes {
  uniform,  ///< all cells alike; together they have the enclosed volume
  local     ///< the present sizes: graded meshes stay graded
};

/// Options of `optimize_mesh`.
struct OptimizeOptions {
  bool fixed_boundary = false;  ///< true: boundary vertices stay; false: they slide along the surface
  CellSizes sizes = CellSizes::local;
  /// Edges of the surface sharper than this angle stay sharp; without a target, so do the creases in the mesh's tags.
  /// Vertices on these edges slide along them. In [0, 180].
  double crease_angle_degrees = kUsualCreaseAngle;
  /// Weight of the cells' shape, > 0. It is lowered while the mean distance between the boundary and its surface is too
  /// large. If the largest distance is too large, only the cells beside such places get less weight.
  double lambda = 0.1;
  double quality = kUsualQuality;  ///< least scaled Jacobian to aim at first, in [0, 0.8]; 0: none
  /// Largest acceptable distances, in percent of the diagonal, > 0.
  double mean_tolerance_percent = 0.05, max_tolerance_percent = 0.5;
  SolveControl control{};
  Tuning tuning{};  ///< for experiments
};

/// The mesh, and how the optimization went.
struct OptimizeResult {
  VolumeMesh mesh;                 ///< the given mesh with new positions
  std::vector<Index> uncertified;  ///< cells that are not certified, ascending
  FitReport report;
};

/// Makes the cells of a mesh valid, then well shaped, while its boundary keeps its surface.    Paper: section 4.2
///
/// Cells that are not certified are untangled (`untangle`): first with a fixed boundary; if that does not suffice, with
/// boundary vertices that slide while sharp edges are kept; and at last without the sharp edges that touch the cells in
/// question. Then E = E_S + lambda E_W is minimized with the Hencky barrier, as in the fits: no step makes a cell lose
/// its certificate. Between rounds, each cell's ideal box takes the cell's present proportions (for
/// `CellSizes::local`), and its weight becomes the reciprocal of its least scaled Jacobian, reduced beside places that
/// are too far from the surface. At last, `QualityStages` raise the lowest scaled Jacobians, to the
/// quality that is asked for and then, if it is reached, to 0.1 more; the state before is kept unless the least one is
/// higher, no more cells are uncertified, no more faces meet, and the distances are within nine tenths of the mean
/// tolerance and the largest, or no larger than before. If the quality is missed, all this is repeated up to twice from
/// the state reached, as long as that gains; not for meshes of several regions.
///
/// mesh    must pass `validate` except for inverted cells and unused vertices, else InputError. Without a target, the
///         vertices where its sharp edges meet (`FollowedCreases`) stay fixed, except those of cells that are badly
///         shaped or cannot be untangled.
/// Interfaces between regions (cells of different references) keep their shape as the boundary does without a target:
/// their vertices slide along them, or stay if the boundary is fixed; their sharp edges, and the curves where they meet
/// each other or a boundary without a target, stay sharp. Distances then include theirs.
///
/// Without a target, each region gets the volume back that it had, up to 1e-6 (`restore_volumes`); if its cells do not
/// permit that, a change by more than 1e-4 is a warning. If the volume of one of several regions is off by more than
/// 0.1 %, all is done again with lambda lowered while it is, then with vertices of interfaces fixed, then with those of
/// the boundary fixed, too.
///
/// Faces on flat parts of the target, and flat parts of interfaces, are made exactly flat (`flatten_sheets`) unless the
/// boundary is fixed.
///
/// With `CellSizes::local`, a mesh whose cells are all certified comes back as it is, bit for bit, unless the result is
/// better: of a higher least scaled Jacobian, or of the same and a higher mean, with distances within the tolerances or
/// no larger than before; or closer to a target that it was too far from.
///
/// target  the surface that the boundary must reproduce; null: the present boundary.
/// returns the last state. Unless the work was ended early, report.stop_reason is `stalled` if cells are left that are
/// not certified, which are then listed, and `tolerance_missed` if the distances are too large.
/// InputError: options out of range, an empty target, a target together with `fixed_boundary`.
/// Same bits for any number of threads.
OptimizeResult optimize_mesh(const VolumeMesh& mesh, const TriangleMesh* target, const OptimizeOptions& options);

}  // namespace subvol
