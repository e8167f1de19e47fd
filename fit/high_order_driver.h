// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/elements/boundary_samples.h"
#include "subvol/fit/elements/high_order_mesh.h"
#include "subvol/fit/energies/closest_point_energy.h"
#include "subvol/fit/energies/high_order_energy.h"
#include "subvol/fit/features/crease_distance.h"
#include "subvol/fit/features/followed_creases.h"
#include "subvol/fit/fits/high_order_schedule.h"
#include "subvol/fit/high_order_fit.h"
#include "subvol/fit/solver/fit_problem.h"
#include "subvol/fit/stages/memory_budget.h"
#include "subvol/fit/stages/stage_runner.h"
#include "subvol/fit/stages/staged_fit.h"
#include "subvol/fit/stages/target_creases.h"
#include "subvol/fit/target/fit_target.h"

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace subvol::internal {

/// The base of the high-order fit: the mesh of curved cells and its orders, the minimizations on it, and its measures.
/// All coordinates are normalized.
///
/// Functions that return a bool or an optional return false or nothing if the fit must end, except `meets_tolerance`
/// and `measured_interfaces`.
class HighOrderDriver : protected StagedFit {
 protected:
  const CurvedTuning& tuning() const { return options_.tuning.curved; }
  /// The measures of a state when shape is weighed against distance.
  struct Outcome {
    std::vector<double> cell_minima{};  ///< least scaled Jacobian of each cell
    double least_scaled_jacobian = 0, mean_percent = 0;
    double max_percent = 0;     ///< of surfaces, and of creases from their curves
    std::size_t pairs = 0;      ///< number of intersecting triangle pairs
    double volume_percent = 0;  ///< `volume_percent()`
  };

  /// InputError: options out of range; the template has defects.
  HighOrderDriver(FitTarget target, const VolumeMesh& template_mesh, const HighOrderFitOptions& options);
  ~HighOrderDriver() = default;

  /// Measures the distance of the template, or of the curved cells if there are any by now, chooses the schedule by it,
  /// and finds the interfaces to be kept.
  void look_over_template();
  /// Checks that the memory suffices for a mesh of these orders.
  bool has_room(const EntityOrders& orders);
  /// Ends the fit in its current state. Throws std::runtime_error if nothing has been fitted yet.
  bool end_for_memory(const std::string& why);
  /// Changes the orders of the mesh and of all kept states; their maps stay the same if no order falls.
  void set_orders(const EntityOrders& orders);
  /// Makes the ideal cells boxes of the cells' present sizes, so that graded meshes stay graded.
  void take_own_boxes();

  /// cells  of the mesh that the space consists of, if it is a part of it.
  std::unique_ptr<HighOrderEnergy> volume_energy(const ElementSpace& space, std::span<const Index> cells = {}) const;
  BoundarySamples sheet_samples(const ElementSpace& space) const;
  std::unique_ptr<SurfaceTerm> surface_energy(const BoundarySamples& samples, double tangential_weight) const;
  FitProblem problem(const ElementSpace& space, std::unique_ptr<HighOrderEnergy> volume, const BoundarySamples& samples,
                     const Stage& stage) const;
  /// Minimizes with the present orders and settings, and adds the stage to the report.
  bool run_stage(const Stage& stage);
  /// Does the same, but moves only the surroundings of some cells, those that need it most first. If these would be
  /// more than 40 % of the mesh, a small mesh moves as a whole, and a large one around the first of the cells.
  bool run_stage_around(std::span<const Index> cells, const Stage& stage);
  /// Does the same for a stage of the schedule, and remembers the state before it in `starts_`.
  bool run_next_stage(const Stage& stage);
  bool run_final_stage(double lambda) override { return run_stage(schedule_.final_stage(lambda)); }

  TriangleMesh measured_boundary() const;
  double measured_mean();
  bool meets_tolerance();
  /// Returns the largest difference of a region's volume from the target's, in percent; 0 if the target has no
  /// regions.
  double volume_percent() const;
  /// Measures the distances of the creases; nothing if none follows a curve.
  std::optional<CreaseDistance> measured_creases() const;
  /// moved_only  the state before the last stage had no intersecting pairs, so only what that stage moved is searched.
  std::optional<Outcome> measured_outcome(bool moved_only);
  /// Returns the cells at the boundary that are farther from the target than this, in percent of the diagonal, the
  /// farthest first.
  std::vector<Index> far_cells(double percent) const;
  std::optional<std::size_t> intersecting_pairs() override;
  std::optional<bool> is_folded();
  std::vector<Vec3> in_target_units(std::vector<Vec3> coefficients) const;
  /// The reverse, for a mesh.
  HighOrderMesh in_unit(HighOrderMesh mesh) const;

  std::vector<Vec3>& unknowns() override { return mesh_.coefficients; }
  FitReport& report() override { return report_; }

  HighOrderFitOptions options_;
  FitTarget target_;
  VolumeMesh template_;  ///< with its creases
  FollowedCreases creases_;
  HighOrderSchedule schedule_;
  std::vector<Vec3> ideal_boxes_;
  HighOrderMesh mesh_;
  int try_ = 0;    ///< number of the current attempt, from 1
  int order_ = 1;  ///< highest order of any entity
  /// States before the stages of the schedule in the current attempt, raised to the present orders.
  std::vector<FitSnapshot> starts_;
  std::vector<int> points_;   ///< quadrature points of each cell per direction in the last stage
  bool stays_dense_ = false;  ///< set after the first orders: cells keep at least points_
  double emphasis_ = 0;       ///< emphasis on places of poor shape in E_W
  double hinge_ = 0;          ///< weight of low scaled Jacobians in E_W
  double far_length_ = 0;     ///< distance at which places count twice in E_S; 0: all places count alike
  FitReport report_;
  MemoryBudget memory_;
  StageRunner runner_;

 private:
  int sample_intervals(int order) const;
  int measured_intervals() const;
  StageRecord new_record(const Stage& stage) const;
  std::unique_ptr<ClosestPointEnergy> closest_point_energy(double tangential_weight) const;
  void begin_stage(const Stage& stage);
  TriangleMesh surface_at(const BoundarySamples& samples) const;
  TriangleMesh boundary(int intervals) const;
  std::optional<SurfaceDistance> measured_interfaces() const;
  CreaseRule crease_rule() const {
    return {options_.crease_angle_degrees, options_.keeps_groups, options_.follows_all_edges};
  }
  double keep_mean(double distance);

  BoundarySamples samples_;
  std::vector<Index> moved_cells_;    ///< that the last stage moved, ascending; empty: all
  std::vector<Index> group_of_face_;  ///< `groups_of_sheets`; empty if there are no interfaces, or they are not kept
  int order_in_progress_ = 0;         ///< the order whose part of the work has begun
};

}  // namespace subvol::internal
