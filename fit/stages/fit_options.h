// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/energies/correspondence.h"
#include "subvol/fit/energies/distortion_kind.h"
#include "subvol/fit/stages/fit_report.h"
#include "subvol/fit/stages/solve_control.h"
#include "subvol/fit/target/target_surface.h"
#include "subvol/fit/tuning/tuning.h"
#include "subvol/subdivision/boundary_rule.h"

#include <optional>

namespace subvol {

/// Least scaled Jacobian that fits aim at.
inline constexpr double kUsualQuality = 0.65;
/// Largest quality that may be asked for: hexes around an irregular edge cannot all be better.
inline constexpr double kMostQuality = 0.8;

/// The surface that is compared with the target.
enum class FittedSurface {
  limit,  ///< the Catmull-Clark limit surface of the cage, as modeling tools show it at any level (default)
  mesh    ///< the refined mesh itself (the paper's plain S)
};

/// The method that minimizes the energy.
enum class SolverKind { newton, lbfgs };

/// Options of `fit_subdivision_volume`.
struct FitOptions {
  int levels = 3;  ///< subdivision level of the finest mesh, 1..6
  /// The fit ends once the mean distance is at most this, in percent of the target's diagonal; > 0.
  std::optional<double> tolerance_percent;
  FittedSurface surface = FittedSurface::limit;
  BoundaryRule boundary = BoundaryRule::catmull_clark;
  bool cage_only = false;  ///< the degrees of freedom stay the vertices of the given template
  /// Weights of E_W, > 0. lambda_far: cap on lambda while a level is started. lambda_close: lambda of the last stage on
  /// the finest level; if the fit is not accurate enough, lambda is lowered below it: to a sixteenth of it at
  /// least, or to a thousandth if there is a tolerance.
  double lambda_far = 1.0, lambda_close = 0.005;
  /// Edges of the target sharper than this angle stay sharp if the template has edges that follow them: those template
  /// edges become creases and are drawn to the target's edges. In [0, 180]. Empty: only the template's own tags are
  /// creases, and they are drawn to target edges above 40 degrees.
  std::optional<double> crease_angle_degrees;
  /// Borders between groups of the target's faces are kept in the same way, also where the surface is smooth.
  bool keeps_groups = false;
  SolverKind solver = SolverKind::newton;
  Correspondence correspondence = Correspondence::closest;
  PointWeights point_weights = PointWeights::equal;  ///< weights of a point cloud's points
  Distortion distortion = Distortion::hencky;        ///< the distortion e in E_W
  /// Least scaled Jacobian to aim at on the finest level, in [0, 0.8], as far as the distances allow; 0: none.
  double quality = kUsualQuality;
  /// If the cage does not let the cells reach the quality, the finest mesh is freed from it: all vertices of that mesh
  /// become degrees of freedom, and if that is not enough, it gets a layer of cells inside its boundary
  /// (`internal::free_mesh`). The result then has no cage. If the fit stalled at a lower level, the freed mesh becomes
  /// the template of the levels that are left; the result has a cage if that fit ends with good cells. Without effect
  /// for points, for templates of several regions and if borders between groups are kept; not with cage_only or
  /// keep_states.
  bool frees_mesh = false;
  SolveControl control{};
  double memory_limit_bytes = 0;  ///< for the whole process, see `MemoryBudget`; 0: no limit
  bool keep_states = false;       ///< fills FitResult::states
  Tuning tuning{};                ///< for experiments
};

}  // namespace subvol
