// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/elements/high_order_mesh.h"
#include "fit/stages/fit_report.h"
#include "fit/subdivision_fit.h"

#include <functional>
#include <optional>

namespace subvol {

struct HighOrderFitOptions {
  int order = 4;                                 ///< of the finished mesh, 1..kMaxOrder
  /// Legendre modes are polynomials, which .vtu and .msh hold exactly; Fourier modes (paper: section 3.2) are written
  /// there as polynomials that approximate them.
  Basis basis = Basis::legendre;
  /// Orders rise only where the energy asks for it, up to `order`, and only until the tolerance is met.
  bool adaptive = false;
  std::optional<double> tolerance_percent;       ///< lambda is lowered until the mean distance is below; > 0
  double lambda_close = 0.05;                    ///< > 0
  SolverKind solver = SolverKind::newton;
  Correspondence correspondence = Correspondence::closest;
  PointWeights point_weights = PointWeights::equal;  ///< of a point cloud
  Distortion distortion = Distortion::hencky;    ///< e of E_W
  /// After the last stage: places far from the target nearer, places of poor shape better, where that costs little.
  bool improve_worst_places = true;
  int max_iterations = 0;                        ///< per stage; 0: the schedule's own
  double time_limit_seconds = 0;                 ///< 0: none
  double memory_limit_bytes = 0;                 ///< of the process; 0: none. As `MemoryBudget` keeps it
  std::function<bool(const FitProgress&)> progress;  ///< returns false to cancel; empty: none
  std::function<bool()> cancelled;  ///< asked within steps too, from the calling thread; true cancels; empty: none
  /// Takes the results of minimisations from here and keeps them here; null: no.
  StageLog* log = nullptr;
  bool keep_states = false;                      ///< fills HighOrderFitResult::states
};

struct HighOrderFitResult {
  HighOrderMesh mesh;
  FitReport report;
  /// The coefficients before each minimisation, as far as kept, from the template on; if asked for.
  std::vector<FitState> states;
};

/// Fits curved elements: the template at order 1, then orders raised step by step (paper: Algorithm 1), of all edges,
/// faces and cells alike or of those that gain most (`order_indicator.h`).
///
/// target   triangles in any state that encloses a volume; the unit of length is the target's.
/// template_mesh  hexes, prisms, tets; must pass `validate` but for unused vertices; should lie about where the target
///                is.
/// returns  the last state reached; no step makes a cell lose its certificate (`VolumeTerm::uncertified`). Cells that
///          had none are guarded at their quadrature points only, and the boundary may come to intersect itself: check
///          it.
/// InputError: options out of range, an empty target, a template that is not sound.
HighOrderFitResult fit_high_order(const TriangleMesh& target, const VolumeMesh& template_mesh,
                                  const HighOrderFitOptions& options);

/// The same to points, as `fit_subdivision_volume` does it. InputError: also Correspondence::voronoi.
HighOrderFitResult fit_high_order(const PointCloud& target, const VolumeMesh& template_mesh,
                                  const HighOrderFitOptions& options);

}  // namespace subvol
