// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/energies/correspondence.h"
#include "fit/energies/distortion.h"
#include "fit/stages/fit_report.h"
#include "fit/target/target_surface.h"
#include "subvol/subdivision/boundary_rules.h"

#include <functional>
#include <optional>

namespace subvol {

class StageLog;

/// What the fit is made to agree with the target.
enum class FittedSurface {
  limit,  ///< the Catmull-Clark limit surface of the cage: what an artist's tool shows at any level (default)
  mesh    ///< the refined mesh itself (the paper's plain S)
};

enum class SolverKind { newton, lbfgs };

struct FitOptions {
  int levels = 3;                                ///< subdivision level of the finest mesh, 1..6
  /// Stop once the mean distance is below; per cent of the diagonal, > 0.
  std::optional<double> tolerance_percent;
  FittedSurface surface = FittedSurface::limit;
  BoundaryRule boundary = BoundaryRule::catmull_clark;
  bool cage_only = false;                        ///< unknowns stay on the given template
  double lambda_far = 1.0, lambda_close = 0.005; ///< > 0; close may be lowered further when a tolerance asks for it
  /// Edges of the target sharper than this stay sharp where the template has edges that follow them: those become
  /// creases and are drawn to them. In [0, 180]; empty: only the template's own tags are creases, and are drawn to
  /// edges above 40 degrees.
  std::optional<double> crease_angle_degrees;
  SolverKind solver = SolverKind::newton;
  Correspondence correspondence = Correspondence::closest;
  PointWeights point_weights = PointWeights::equal;  ///< of a point cloud
  Distortion distortion = Distortion::hencky;    ///< e of E_W
  int max_iterations = 0;                        ///< per stage; 0: the schedule's own
  double time_limit_seconds = 0;                 ///< 0: none
  double memory_limit_bytes = 0;                 ///< of the process; 0: none. As `MemoryBudget` keeps it
  std::function<bool(const FitProgress&)> progress;  ///< returns false to cancel; empty: none
  std::function<bool()> cancelled;  ///< asked within steps too, from the calling thread; true cancels; empty: none
  /// Takes the results of minimisations from here and keeps them here; null: no.
  StageLog* log = nullptr;
  bool keep_states = false;                      ///< fills FitResult::states
};

}  // namespace subvol
