// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/energies/quality_energy.h"
#include "fit/solver/fit_problem.h"
#include "fit/stages/stage_runner.h"
#include "subvol/mesh/volume_mesh.h"

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace subvol {

/// One minimization of E_S + lambda E_Q, E_Q being `QualityEnergy`.
struct QualityStage {
  double surface;    ///< w_s: weight of the surface against the cells, > 0
  QualityWeights weights;
  int steps;         ///< at most so many
};

/// The minimizations of one level.
struct QualitySchedule {
  std::vector<QualityStage> stages;
  /// The lift: this stage is repeated, two steps at a time, with rising emphasis on what is still poor.
  QualityStage lift;
  double goal;       ///< least scaled Jacobian at which the lift ends
};

/// Schedules for a template of a few hundred cells or more at the surface's place: its cells are drawn to the surface
/// first and are lifted then; and for the refinement of a mesh that was fitted so.
/// goal  least scaled Jacobian wanted, in (0, 1).
/// A schedule of a few steps without a lift brings a template near the surface, to find out what lies where.
QualitySchedule smooth_quality_schedule();
QualitySchedule coarse_quality_schedule(double goal);
QualitySchedule fine_quality_schedule(double goal);

/// Least scaled Jacobian that fits aim at.
inline constexpr double kUsualQuality = 0.65;

/// Runs the minimizations of one level on one problem.
class QualityStages {
 public:
  /// mesh     the level's mesh; must outlive this. Its positions are not read.
  /// lengths  wanted lengths of each cell (`QualityEnergy`), in shares of the target's diagonal.
  /// nodes, samples  as in `FitProblem`.  surface  over these samples; null: the surface does not matter.
  /// target_length   L of the target (`TargetSurface::length`).
  QualityStages(const VolumeMesh& mesh, std::span<const Vec3> lengths, SparseMap nodes, SparseMap samples,
                std::unique_ptr<SurfaceTerm> surface, double target_length);

  /// State of the cells at the last check.
  using State = QualityEnergy::State;

  /// Runs all stages, then the lift. name  of the level, for reports.  record  level and number of cells are set.
  /// x  the degrees of freedom; after the lift, those of the state with the highest least scaled Jacobian.
  /// returns  false if the fit must end, with its reason in the report.
  bool run(const QualitySchedule& schedule, const StageRunner& runner, const StageRecord& record, double fraction,
           std::vector<Vec3>& x, FitReport& report);

  const State& state() const { return state_; }
  QualityEnergy& energy() { return *energy_; }

 private:
  bool run_stage(const QualityStage& stage, const std::string& name, double relative_decrease, std::vector<Vec3>& x);
  bool lift(const QualitySchedule& schedule, std::vector<Vec3>& x);

  double mean_length_;    ///< wanted, of the cells at the boundary
  double lambda_one_;     ///< lambda for w_s = 1
  QualityEnergy* energy_; ///< owned by the problem
  FitProblem problem_;
  State state_;
  // Of the call of `run` in progress.
  const StageRunner* runner_ = nullptr;
  StageRecord record_;
  double fraction_ = 0;
  FitReport* report_ = nullptr;
};

}  // namespace subvol
