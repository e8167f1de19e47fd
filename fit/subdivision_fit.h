// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/fit_report.h"
#include "fit/distortion.h"
#include "subvol/fit_state.h"
#include "subvol/point_cloud.h"
#include "subvol/subdivision.h"
#include "subvol/triangle_mesh.h"
#include "subvol/volume_mesh.h"

#include <functional>
#include <optional>
#include <vector>

namespace subvol {

class StageLog;

/// What the fit is made to agree with the target.
enum class FittedSurface {
  limit,  ///< the Catmull-Clark limit surface of the cage: what an artist's tool shows at any level (default)
  mesh    ///< the refined mesh itself (the paper's plain S)
};

enum class SolverKind { newton, lbfgs };

/// What pulls at what in the surface energy.
enum class Correspondence {
  closest,  ///< exact closest points, both ways (`ClosestPointEnergy`): better cells at the same distance (default)
  voronoi   ///< the paper's restricted Voronoi cells (`SurfaceEnergy`)
};

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

struct FitResult {
  VolumeMesh cage;   ///< the last control mesh with its tags: its limit surface is the fitted surface
  VolumeMesh mesh;   ///< the finest finite element mesh (boundary at limit positions for FittedSurface::limit)
  FitReport report;
  /// Where the cage was before each minimisation, as far as kept, from the template on; if asked for.
  std::vector<FitState> states;
};

/// Fits a subdivision volume recursively (paper: section 4.3).
///
/// target   triangles in any state that encloses a volume; the unit of length is the target's.
/// template_mesh  hexes, prisms, tets; must pass `validate` but for unused vertices; should lie about where the target
///                is.
/// returns  the best state reached; every cell of `mesh` is certified (`certificate.h`) unless report.stop_reason is
///          `stalled`, or the template has cells that are not: no step makes a certified cell lose its certificate.
/// InputError: options out of range, an empty target, a template that cannot be subdivided or that has inverted cells.
FitResult fit_subdivision_volume(const TriangleMesh& target, const VolumeMesh& template_mesh,
                                 const FitOptions& options);

/// The same to points: every one of them pulls at the nearest place of the fitted surface (inverse fitting), and all
/// distances are from the points to the surface. Where there are no points cells alone tell where the surface runs.
///
/// InputError: also crease_angle_degrees, and Correspondence::voronoi, which need triangles.
FitResult fit_subdivision_volume(const PointCloud& target, const VolumeMesh& template_mesh, const FitOptions& options);

}  // namespace subvol
