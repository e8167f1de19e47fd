// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/energies/closest_point_energy.h"
#include "subvol/fit/energies/quality_energy.h"
#include "subvol/fit/features/crease_energy.h"
#include "subvol/fit/solver/fit_problem.h"
#include "subvol/fit/stages/fit_report.h"
#include "subvol/fit/stages/quality_patches.h"
#include "subvol/fit/stages/stage_runner.h"
#include "subvol/fit/target/target_surface.h"
#include "subvol/fit/tuning/quality_tuning.h"
#include "subvol/mesh/volume_mesh.h"

#include <algorithm>
#include <array>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace subvol::internal {

/// One minimization of E_S + lambda E_Q, E_Q being `QualityEnergy`.
struct QualityStage {
  double surface;  ///< w_s: weight of the surface against the cells, > 0
  QualityWeights weights;
  int steps;  ///< at most so many
};

/// Judges the states of a lift; the one with the highest merit is kept:
///
///   merit = 1 - (sum over cells c_c^4 + sum over sample triangles c_t^4)^(1/4)
///
/// c_c  cost of a cell that misses the goal, c_t that of a place that is too far, see below; 0 where all is well
///
/// This is close to the cost of the worst place, but others count as well: otherwise, what is gained elsewhere would be
/// lost with a state in which the worst place, which may be hopeless, is slightly worse.
struct LiftMerit {
  double excess = 2;  ///< cost of a place that is twice as far from the target as it should be, or farther
  double poor = 0;    ///< additional cost of a cell for each share of the goal that it lacks to four fifths of the goal

  /// share  least share of the goal that a point of the cell has reached, at most 1.
  double cost_of_cell(double share) const;
  /// distance_excess  distance as a share of what it should be, less 1.
  double cost_of_place(double distance_excess) const { return excess * std::clamp(distance_excess, 0.0, 1.0); }
};

/// The minimizations of one level.
struct QualitySchedule {
  std::vector<QualityStage> stages;
  /// The lift: this stage is repeated, two steps at a time, with rising emphasis on what is still poor.
  QualityStage lift;
  double goal;  ///< least scaled Jacobian at which the lift ends
  /// Largest distance to aim at in the lift, as a share of the diagonal; 0: none. Where the surfaces are farther apart
  /// than most of it, they draw each other more and more, as poor cells are emphasized more and more.
  double most_distance = 0;
  /// Share of `most_distance` from which on places are emphasized.
  double far_margin = 0.5;
  LiftMerit merit;  ///< of the states of the lift
  /// Patches around the worst cells alone are lifted, too, if those around all poor cells are most of a cage.
  bool lifts_worst_of_cage = false;

  /// Number of steps of the whole mesh that the schedule is expected to take, for forecasts of work.
  double expected_steps() const;
  /// Multiplies the weight of the surface in all stages.
  void give_surface_more_weight(double factor);
};

/// A schedule of a few steps without a lift, which brings a template near the surface, to find out what lies where.
QualitySchedule smooth_quality_schedule();

/// Schedules for a template of a few hundred cells or more at the surface's place: its cells are drawn to the surface
/// first and are lifted then; and for the refinement of a mesh that was fitted so.
/// goal  least scaled Jacobian wanted, in (0, 1).
QualitySchedule coarse_quality_schedule(double goal, const QualityTuning& tuning = {});
QualitySchedule fine_quality_schedule(double goal, const QualityTuning& tuning = {});

/// A schedule for a mesh that is not refined afterwards: the stages of the first, the lift of the second of these.
QualitySchedule single_quality_schedule(double goal, const QualityTuning& tuning = {});

/// A schedule for a mesh whose surface is where it should be: a lift in which only poor cells exert a force, so that
/// the surface moves as little as possible.
QualitySchedule late_quality_schedule(double goal, const QualityTuning& tuning = {});

/// The boundary of a mesh as it is compared with the target: sample triangles on its faces.
struct QualityBoundary {
  SparseMap samples;                            ///< degrees of freedom -> samples; no rows: the surface does not matter
  std::vector<Vec3> fixed;                      ///< what is added to the samples if vertices are fixed; else empty
  std::vector<std::array<Index, 3>> triangles;  ///< of samples
  std::vector<Index> triangle_faces;            ///< face of the mesh of each triangle, by `MeshTopology`
  std::vector<Index> interfaces;                ///< faces between regions that have sample triangles, too
  /// Groups of each face of the mesh and of each of the target's triangles (`ClosestPointEnergy::set_groups`); empty:
  /// none.
  std::vector<Index> group_of_face, group_of_triangle;
};

/// Runs the minimizations of one level on one problem.
class QualityStages {
 public:
  /// mesh     the level's mesh; must outlive this. Its positions are not read.
  /// lengths  wanted lengths of each cell (`QualityEnergy`), in shares of the target's diagonal.
  /// nodes    degrees of freedom -> vertices of the mesh.  fixed  positions of vertices without entries in `nodes`, 0
  ///          for the others; empty: none is fixed.
  /// target   must outlive this; sampled about four times for each boundary face.
  /// creases  energy(width) of the creases that follow edges of the target, over the samples; empty: there are none.
  QualityStages(const VolumeMesh& mesh, std::span<const Vec3> lengths, const SparseMap& nodes, std::vector<Vec3> fixed,
                const QualityBoundary& boundary, const TargetSurface& target,
                const std::function<CreaseEnergy(double width)>& creases = {}, const QualityTuning& tuning = {});

  /// A state that the lift reached.
  struct State {
    static constexpr double kNotJudged = -1e300;  // below the merit of every state
    QualityEnergy::State cells;
    double merit = kNotJudged;       ///< see `LiftMerit`. 1: all aims are reached
    std::vector<Index> far_cells{};  ///< cells at the boundary that are farther than what is aimed at, ascending

    /// False if the stages were ended before the lift: then the figures of the cells are not those of a mesh.
    bool is_judged() const { return merit > kNotJudged; }
  };

  /// Runs all stages, then the lift: on the whole mesh while many cells are poor, then patch by patch (`QualityPatch`).
  /// name  of the level, for reports.  record  level and number of cells are set.
  /// x  the degrees of freedom; after the lift, those of the state with the highest merit, on each patch.
  /// returns  false if the fit must end, with its reason in the report.
  bool run(const QualitySchedule& schedule, const StageRunner& runner, const StageRecord& record, std::vector<Vec3>& x,
           FitReport& report);

  /// Minimizes patches around some cells, the rest held fixed, so that their quality counts more than the surface.
  ///
  /// centers  cells, ascending.  rings  as in `quality_patches`.  stage  how each patch is minimized.
  /// record   name of the stage in the report, level and number of cells are set.
  /// returns  as `run`. Nothing is done if the patches are most of the mesh.
  bool relax(std::span<const Index> centers, int rings, const QualityStage& stage, const StageRunner& runner,
             const StageRecord& record, std::vector<Vec3>& x, FitReport& report);

  /// Called before each minimization; x then holds the state that it starts from. Empty: nothing is called.
  std::function<void()> before_stage;
  /// Called with the name and the result of each minimization of the whole mesh, and after the lift of patches. May be
  /// empty.
  std::function<void(const std::string& name, const std::vector<Vec3>& x)> after_stage;

  const State& state() const { return state_; }
  QualityEnergy& energy() { return *energy_; }

 private:
  /// The minimizations of a patch of a level, whose correspondences must be those of x.
  QualityStages(const QualityStages& whole, const QualityPatch& patch, std::span<const Vec3> x);
  bool run_stage(const QualityStage& stage, const std::string& name, bool is_lift, std::vector<Vec3>& x);
  bool lift(const QualitySchedule& schedule, std::vector<Vec3>& x);
  bool run_patches(const QualitySchedule& of_patch, std::span<const QualityPatch> patches, const std::string& name,
                   std::vector<Vec3>& x);
  std::vector<QualityPatch> patches_of(const State& state, double share, int rings) const;
  std::vector<QualityPatch> patches_around(std::span<const Index> centers, int rings) const;
  State inspect(const QualitySchedule& schedule, std::span<const Vec3> x);
  double emphasize_far(const QualitySchedule& schedule, std::span<const Vec3> x, State& state);

  std::unique_ptr<VolumeMesh> patch_mesh_;  ///< of a patch; null: a whole level
  const VolumeMesh* mesh_;
  QualityTuning tuning_;
  double damping_ = tuning_.first_damping;  ///< for the next stage
  double mean_length_ = 0;                  ///< wanted, of the cells at the boundary
  double lambda_one_ = 1;                   ///< lambda for w_s = 1
  double step_work_ = 1;                    ///< of a step, as a share of one of the whole level
  std::unique_ptr<FitProblem> problem_;
  QualityEnergy* energy_ = nullptr;  ///< owned by the problem, as is the next
  ClosestPointEnergy* surface_ = nullptr;
  std::vector<double> factors_, far_emphasis_;  ///< of each sample triangle
  std::vector<Index> triangle_cells_;           ///< cell at each sample triangle; empty: a patch
  State state_;
  // These belong to the call of `run` that is in progress.
  const StageRunner* runner_ = nullptr;
  StageRecord record_;
  FitReport* report_ = nullptr;
};

}  // namespace subvol::internal
