// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/automatic_attempts.h"
#include "subvol/fit/automatic_fit.h"
#include "subvol/fit/automatic_trials.h"
#include "subvol/fit/features/crease_energy.h"
#include "subvol/fit/fits/fitted_cage.h"
#include "subvol/fit/stages/quality_stages.h"
#include "subvol/fit/stages/stage_runner.h"
#include "subvol/fit/target/fit_target.h"
#include "subvol/mesh/mesh_topology.h"
#include "subvol/mesh/volume_mesh.h"
#include "subvol/surface/triangle_mesh.h"

#include <algorithm>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace subvol::internal {

/// Returns the share of its wanted length that an edge must have: a tenth; less on a grid whose cells are flat, in
/// proportion to their shortest edge. 0 without a grid.
/// lengths  wanted, of the grid's cells, and perhaps of more.
double least_edge_share(const VolumeMesh& grid, std::span<const Vec3> lengths);

/// The faces of a mesh's boundary and of its interfaces as one surface, on its vertices.
/// face_of_triangle  if not null, receives the face of each triangle, by `topology`.
TriangleMesh sheet_triangles(const VolumeMesh& mesh, const MeshTopology& topology,
                             std::vector<Index>* face_of_triangle = nullptr);

/// The common base of the automatic fits of one solid and of several regions: it makes a template, fits it level by
/// level, judges the result, and keeps the best one. All coordinates are normalized.
///
/// Functions that return a bool return false if the fit must end.
class AutomaticDriver {
 protected:
  /// target: any that a `FitTarget` is made from.
  template <class Target>
  AutomaticDriver(const AutomaticFitOptions& options, const Target& target)
      : options_(checked_options(options)),
        target_(target),
        runner_(options.control, SolverKind::newton, options.tuning) {}
  ~AutomaticDriver() = default;

  const AutomaticFitTrial& best() const { return result_.trials[result_.chosen]; }
  /// Returns true if the best trial is good enough (`is_good_enough`).
  bool is_good() const { return !result_.trials.empty() && is_good_enough(best(), options_.tuning.automatic); }

  /// Returns true if the present mesh is that of the best trial.
  bool is_present_best() const { return taken_best_ == result_.chosen || result_.chosen + 1 == result_.trials.size(); }
  /// To be called if the present mesh was made that of the best trial: takes its states and stages as well.
  void take_states() {
    states_ = result_.states;
    stages_ = stages_of_best_;
    taken_best_ = result_.chosen;
  }
  /// To be called if the present mesh is a new one.  stages  that led to it, by their numbers in the report.
  void begin_mesh(std::vector<std::size_t> stages = {}) { stages_ = std::move(stages); }
  /// Returns the stages that led to the present mesh, and to that of the best trial.
  const std::vector<std::size_t>& stages() const { return stages_; }
  const std::vector<std::size_t>& stages_of_best() const { return stages_of_best_; }

  /// Begins an attempt that takes this portion of the work that is left.
  void begin_attempt(double portion = kAttemptPortion) {
    const double done = runner_.work().share_at_end();
    share_at_end_ = done + portion * (1 - done);
  }
  /// Begins a part of the attempt that takes this portion of what is left of it.
  /// forecast: in steps; parts without stages and lifts, such as relaxations, count as one.
  void begin_part(double portion, double forecast) {
    runner_.work().begin_portion(portion, share_at_end_, std::max(forecast, 1.0));
  }
  /// Begins the part of an attempt that makes its template. Returns what to call with its share that is done.
  std::function<bool(double)> begin_template();
  /// Tells in the report that the fit ended in this work.
  void note_end_in(const char* work) { runner_.give_up(work, result_.report); }
  /// Makes the present mesh the cage of the mesh that it is subdivided to, which is then the present one.
  virtual void begin_cage();
  /// Fits the present mesh at one level. what: is added to its name in the report.
  /// portion: of the attempt's remaining work.
  virtual bool fit_level(int level, const QualitySchedule& schedule, const char* what, double portion = 1) = 0;
  /// Measures the present mesh, and keeps it if it is the best one.
  virtual bool judge(AutomaticFitTrial trial) = 0;

  /// Returns the schedule of a mesh that is not refined any more, which aims at a largest distance as well.
  QualitySchedule aiming_at_distance(QualitySchedule schedule) const {
    return aiming_at(aimed_max_percent(), std::move(schedule));
  }
  /// The largest distance to aim at, in percent of the diagonal: at most the one allowed.
  virtual double aimed_max_percent() const { return options_.max_tolerance_percent; }
  /// Fits the present mesh, refines it so many times, fitting it each time, and judges it. If a cage is made, the last
  /// mesh is fitted by the vertices of the one before.
  bool fit_and_refine(int levels);
  /// Fits and judges the present mesh, which follows edges and is not refined. If a cage is made, that mesh is near the
  /// target and becomes the cage.
  bool fit_edges(AutomaticFitTrial trial, double portion);
  /// Returns a cell at each face of a mesh's boundary and interfaces that meets another one, once for each pair of
  /// their triangles.
  std::vector<Index> cells_that_meet(const VolumeMesh& mesh) const;
  /// Relaxes the present mesh where its boundary meets itself or cells are hopeless, and judges it as another
  /// trial, if the last one was kept from being the best by that alone.
  bool relax_last_trial();
  /// Lifts the best trial beyond the quality aimed at, and judges the result as another trial, if it is the present
  /// mesh and good: by a step as long as the last one was reached, while its surface stays about where it is.
  bool polish();
  /// Minimizes (`QualityStages`). The report gets the distance of the first mesh, as it is before that.  creases  may
  /// be empty.  prepare  is called with the stages before they run; may be empty.
  bool run_stages(const QualityBoundary& boundary, std::span<const Vec3> lengths,
                  const std::function<CreaseEnergy(double)>& creases, int level, const QualitySchedule& schedule,
                  const char* what, const std::function<void(QualityStages&)>& prepare = {});
  /// Samples the target for a boundary of so many faces.
  void sample_target(std::size_t faces);
  /// Adds a trial that was measured; its mesh is the present one. Returns true if it is the best one.
  bool keep_if_best(AutomaticFitTrial trial, const QualityReport& quality, std::optional<CreaseDistance> edges,
                    std::span<const UnfollowedCurve> unfollowed);
  /// Brings the result into the target's coordinates.
  /// going  false if the fit was ended early.  edges  what the target's curves are called.
  AutomaticFitResult finish(bool going, const char* edges);

  AutomaticFitOptions options_;
  FitTarget target_;
  VolumeMesh mesh_;
  std::optional<FittedCage> cage_;  ///< of the present mesh; none: its own vertices are the unknowns
  std::string no_template_;         ///< why the last template that was asked for does not exist; empty: it does
  QualityStages::State state_;      ///< that the last level reached; its share is that of the lower goal at caps
  AutomaticFitResult result_;
  StageRunner runner_;

  /// Brings the mesh of the cage, if there is one, to where the cage is.
  void follow_cage() {
    if (cage_) mesh_.positions = cage_->nodes();
  }

 private:
  std::vector<Vec3>& unknowns() { return cage_ ? cage_->cage.positions : mesh_.positions; }
  QualitySchedule aiming_at(double max_percent, QualitySchedule schedule) const;
  std::vector<Index> hopeless_cells(bool may_meet) const;
  bool relax_hopeless_cells(QualityStages& stages, const StageRecord& record);

  bool has_started_ = false;                          ///< a mesh has been fitted
  bool is_relaxing_ = false;                          ///< `relax_hopeless_cells` precedes the stages
  std::optional<Vec3> relaxed_at_;                    ///< its first place, in the target's coordinates
  std::vector<FitState> states_;                      ///< of the present mesh, if they are kept
  std::vector<std::size_t> stages_, stages_of_best_;  ///< that led to the present mesh, to that of the best trial
  std::optional<std::size_t> taken_best_;             ///< number of the trial at `take_states`
  std::optional<std::size_t> last_polished_;  ///< number of the trial that was polished, or is the result of that
  double share_at_end_ = 0;                   ///< of the attempt in progress
};

}  // namespace subvol::internal
