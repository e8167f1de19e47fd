// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/elements/high_order_mesh.h"
#include "subvol/fit/stages/fit_report.h"
#include "subvol/fit/stages/solve_control.h"
#include "subvol/fit/subdivision_fit.h"
#include "subvol/fit/tuning/tuning.h"

#include <optional>

namespace subvol {

/// Weight of the cells' shape in the last stage of a high-order fit. The lower one is for meshes that lie on the target
/// already: those that are to be curved, and templates whose creases follow nearly all of the target's sharp edges (98
/// % of their length). Lowering the usual weight step by step gets stuck at cells that are nearly flat; starting low
/// gets past them.
inline constexpr double kLambdaOfOrders = 0.05, kCurvingLambda = 0.0025;

/// Options of `fit_high_order`.
struct HighOrderFitOptions {
  int order = 4;  ///< order of the finished mesh, 1..kMaxOrder
  /// Legendre modes are polynomials, which .vtu and .msh store exactly. Fourier modes (paper: section 3.2) are written
  /// to these formats as approximating polynomials.
  Basis basis = Basis::legendre;
  /// p-adaptive: orders are raised, up to `order`, only where the energy gains from it and only until the tolerance is
  /// met.
  bool adaptive = false;
  /// Lambda is lowered until the mean distance is at most this, in percent of the diagonal; > 0. It is also lowered
  /// until the volumes of the target's regions are within `kAutomaticVolumePercent`.
  std::optional<double> tolerance_percent;
  std::optional<double> lambda_close;  ///< lambda of the last stage, > 0; empty: one of the two above
  /// As in FitOptions: edges of the target sharper than this angle, and borders between groups, that edges of the mesh
  /// are drawn to. Empty: only creases that the template tags are drawn to target edges above 40 degrees.
  std::optional<double> crease_angle_degrees;
  /// False: if the template has creases, only those are followed; if not, edges are followed only on surfaces of
  /// designed parts (`EdgeCrispness::is_designed`), not on scans.
  bool follows_all_edges = true;
  bool keeps_groups = false;
  SolverKind solver = SolverKind::newton;
  Correspondence correspondence = Correspondence::closest;
  PointWeights point_weights = PointWeights::equal;  ///< weights of a point cloud's points
  Distortion distortion = Distortion::hencky;        ///< the distortion e in E_W
  /// After the last stage, brings places far from the target closer and improves places of poor shape if that costs
  /// little elsewhere.
  bool improve_worst_places = true;
  double quality = kUsualQuality;  ///< least scaled Jacobian to aim at then, in [0, 0.8]; 0: none
  SolveControl control{};
  double memory_limit_bytes = 0;  ///< for the whole process, see `MemoryBudget`; 0: no limit
  bool keep_states = false;       ///< fills HighOrderFitResult::states
  Tuning tuning{};                ///< for experiments
};

/// The curved mesh, and how the fit went.
struct HighOrderFitResult {
  HighOrderMesh mesh;
  FitReport report;
  double lambda_close;  ///< lambda that was asked for, or chosen
  /// The coefficients before each minimization that was kept, starting with the template; filled if asked for.
  std::vector<FitState> states;
};

/// Fits curved elements: starts from the template at order 1 and raises the orders step by step (paper: Algorithm 1),
/// either uniformly or only for the edges, faces and cells that gain most (`order_indicator.h`).
///
/// target         triangles in any state that encloses a volume; the unit of length is the target's.
/// template_mesh  hexes, prisms and tets, no pyramids; must pass `validate` except for unused vertices and should lie
///                roughly at the target's place. Interfaces between its regions (cells of different references) are
///                fitted to themselves as they are, unless the target is a cloud.
/// returns        the last state reached. No step makes a cell lose its certificate (`VolumeTerm::uncertified`). Cells
///                that had none are only guarded at their quadrature points, and the boundary may come to intersect
///                itself, so check the result.
/// InputError: options out of range, an empty target, an invalid template.
HighOrderFitResult fit_high_order(const TriangleMesh& target, const VolumeMesh& template_mesh,
                                  const HighOrderFitOptions& options);

/// Fits curved elements from cells that are curved already: to the surface, with the orders that they have or, where
/// `HighOrderFitOptions::order` is higher, that one.
///
/// start    of hexes, prisms and tets, close to the target; its basis is that of the result (`basis` is ignored), and
///          `adaptive` is, too. Its cells should be certified (`optimize_curved`).
/// labels   the same cells with their references, groups and tags; its positions are not read.
///          Interfaces between its regions are fitted to those of the target if it has the same regions, otherwise to
///          themselves, as curved as they are.
/// InputError: as above; other cells in `labels`.
HighOrderFitResult fit_high_order(const TriangleMesh& target, const HighOrderMesh& start, const VolumeMesh& labels,
                                  const HighOrderFitOptions& options);

/// Fits curved elements to points, as `fit_subdivision_volume` does. InputError: also for crease_angle_degrees and
/// Correspondence::voronoi, which need triangles.
HighOrderFitResult fit_high_order(const PointCloud& target, const VolumeMesh& template_mesh,
                                  const HighOrderFitOptions& options);

}  // namespace subvol
