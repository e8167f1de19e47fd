// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/features/followed_creases.h"
#include "subvol/fit/fits/fit_level.h"
#include "subvol/fit/fits/fit_schedule.h"
#include "subvol/fit/geometry/surface_distance.h"
#include "subvol/fit/stages/memory_budget.h"
#include "subvol/fit/stages/quality_stages.h"
#include "subvol/fit/stages/stage_runner.h"
#include "subvol/fit/stages/staged_fit.h"
#include "subvol/fit/stages/target_creases.h"
#include "subvol/fit/subdivision_fit.h"
#include "subvol/fit/target/fit_target.h"
#include "subvol/subdivision/limit_surface.h"

#include <cstddef>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace subvol::internal {

/// The base of the fit of a subdivision volume: its levels, the minimizations on them, and its measures. All
/// coordinates are normalized.
///
/// Functions that return a bool or an optional return false or nothing if the fit must end, except `meets_tolerance`
/// and `finest`.
class SubdivisionDriver : protected StagedFit {
 protected:
  /// A range of stages in a report.
  struct StageRange {
    std::size_t begin = 0, end = 0;
  };
  /// Properties of a state that the quality stages must not spoil.
  struct Measured {
    double least_jacobian;
    std::size_t uncertified, pairs;
    std::vector<SurfaceDistance> distances;  ///< of the finest mesh, of its interfaces, and of the limit surface

    double largest() const;
    /// Returns true if the quality has risen, and nothing else has suffered.
    bool gains_on(const Measured& before, std::optional<double> tolerance_percent, const QualityTuning& tuning) const;
  };

  /// InputError: options out of range; the template has defects.
  /// levels_before  number of levels of the fit whose mesh is the template.
  SubdivisionDriver(FitTarget target, const VolumeMesh& template_mesh, const FitOptions& options, int levels_before);
  ~SubdivisionDriver() = default;

  /// Records the template's audit and its initial distance in the report, and makes the schedule.
  void look_over_template();
  /// Begins an attempt: the degrees of freedom are the template's vertices.
  void begin(double own_box_share);
  /// Checks that the memory suffices for the next level.
  bool has_room();
  /// Ends the fit with the stored state. Throws std::runtime_error if there is none and no fit went before.
  bool end_for_memory(const std::string& why);
  void prepare_level();
  bool start_level();
  /// Ends a fit to some of the target's samples with a few steps toward all of them.
  bool fit_all_samples();
  /// Runs one minimization on the current level.
  bool run_stage(const Stage& stage, const std::string& name);
  bool run_stage(const Stage& stage) { return run_stage(stage, stage_name(stage)); }
  bool run_final_stage(double lambda) override { return run_stage(schedule_.final_stage(lambda)); }
  bool run_quality_stages(const QualitySchedule& schedule);
  void store_result();
  void next_control();

  double measured_mean();
  VolumeMesh current_mesh() const;
  double mean_scaled_jacobian() const;
  std::optional<std::size_t> intersecting_pairs() override;
  bool meets_tolerance();
  /// past_limit  the state is measured although the time limit has been reached.
  std::optional<Measured> measure(bool past_limit = false);
  bool finest() const { return number_ == options_.levels; }
  /// Returns the level of the finite element mesh as reports count it.
  int level() const { return levels_before_ + number_; }
  std::vector<Vec3>& unknowns() override { return unknowns_; }
  FitReport& report() override { return result_.report; }

  FitOptions options_;
  FitTarget target_;     ///< sampled for the current level
  VolumeMesh template_;  ///< normalized, with its creases
  VolumeMesh cage_;      ///< the mesh whose vertices are the degrees of freedom
  std::vector<Vec3> unknowns_;
  int levels_before_ = 0;
  int try_ = 0;  ///< number of attempts begun, each with other ideal cells
  FitSchedule schedule_;
  int number_ = 0;  ///< level of the finite element mesh, from 1 in each attempt
  FitLevel level_;
  FitResult result_;
  StageRange result_stages_;  ///< the stages that led to the state stored in result_
  std::map<std::string, double> seconds_;
  MemoryBudget memory_;
  StageRunner runner_;

 private:
  CreaseRule crease_rule() const { return {options_.crease_angle_degrees, options_.keeps_groups}; }
  void sample_target();
  std::string stage_name(const Stage& stage) const;
  std::unique_ptr<SurfaceTerm> surface_term(const Stage& stage) const;
  TriangleMesh limit_triangles();
  /// Returns the distances between the target and the current state: of the finite element mesh, of its interfaces, and
  /// of the limit surface. `extremes`: with the largest ones.
  const std::vector<SurfaceDistance>& distances(bool extremes);
  /// Notes the mean distance of the current state.
  void note_mean(std::span<const SurfaceDistance> distances);

  /// Distances that were measured, and the degrees of freedom that they belong to.
  struct KnownDistances {
    std::vector<Vec3> unknowns;
    bool extremes;
    std::vector<SurfaceDistance> distances;
  };
  std::optional<KnownDistances> known_distances_;  ///< on the current level
  bool samples_all_ = true;                        ///< false: only some of the target's samples are used
  VolumeMesh control_;                             ///< the control mesh (for cage-only fits, its last refinement)
  FollowedCreases template_creases_, creases_;     ///< creases of template_ and of level_.mesh
  SparseMap from_unknowns_;                        ///< maps the degrees of freedom to control_'s vertices
  SparseMap previous_nodes_;                       ///< maps them to the nodes of the last certified finite element mesh
  double own_box_share_ = 0;                       ///< of the current attempt
  std::vector<Vec3> ideal_boxes_;                  ///< of the current level's cells
  std::optional<BoundaryRefinement> limit_check_;  ///< refinement of level_.mesh, made when first needed
  std::size_t try_begin_ = 0;                      ///< number of stages in the report when the attempt began
};

}  // namespace subvol::internal
