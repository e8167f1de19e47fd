// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/elements/boundary_samples.h"
#include "subvol/fit/energies/surface_term.h"
#include "subvol/fit/features/followed_creases.h"
#include "subvol/fit/optimize_mesh.h"
#include "subvol/fit/solver/fit_problem.h"
#include "subvol/fit/stages/fit_report.h"
#include "subvol/fit/stages/quality_stages.h"
#include "subvol/fit/stages/stage_runner.h"
#include "subvol/fit/target/fit_target.h"
#include "subvol/mesh/interfaces.h"
#include "subvol/mesh/mesh_topology.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace subvol::internal {

/// Least rise of the least or the mean scaled Jacobian that is a gain; less is rounding.
inline constexpr double kLeastJacobianGain = 1e-6;

/// Weight of tangential differences in correspondences.
inline constexpr double kOptimizeTangentialWeight = 0.003;

/// Points per direction for energies and scaled Jacobians: the corners only, where cells are worst. The certificate
/// detects cells that are inverted elsewhere, and these get more points.
inline constexpr int kCornerPoints = 2;

/// The base of `optimize_mesh`: the mesh with its features and interfaces, the minimizations on it, and its measures.
/// All coordinates are normalized.
///
/// Functions that return a bool return false if the work must end, except those that ask something.
class OptimizeDriver {
 protected:
  enum class Boundary { fixed, sliding };
  /// An attempt holds more than the one before if that changed the volumes of regions: first nothing, then the volumes
  /// (lambda is lowered for them), then also the vertices of interfaces, and at last those of the boundary.
  enum class Held { nothing, volumes, interfaces, sheets };
  /// Properties of a state that the quality stages must not spoil.
  struct Measured {
    double least_jacobian = -1, mean_jacobian = -1, mean_percent = 0, max_percent = 0;
    std::size_t uncertified = 0, intersections = 0;
    double volume_change = 0;  ///< largest relative change of a region's volume, if the mesh has several
  };

  /// target  null: the mesh's own boundary. InputError: options out of range, a mesh that does not pass `validate`.
  OptimizeDriver(const VolumeMesh& mesh, const TriangleMesh* target, const OptimizeOptions& options);
  ~OptimizeDriver() = default;

  /// Finds the sharp edges that are kept, and samples the boundary.
  void find_features();
  void release_corners(std::span<const Index> cells);
  void release_features(std::span<const Index> cells);
  void find_sizes();
  /// untangles  the cells are not yet valid: places that are far off get no emphasis. x: receives the unknowns.
  FitProblem make_problem(Boundary boundary, double lambda, bool untangles, std::vector<Vec3>& x) const;
  StageRecord record(std::string name) const;
  /// Minimizes from the present state, and measures the distances at the samples.
  bool run_stage(const std::string& name, double lambda, int steps);
  bool run_quality_stages(const QualitySchedule& schedule);
  /// Weighs the cells by what they lack: least_jacobians, one per cell.
  void weigh_cells(std::span<const double> least_jacobians);

  void measure_start();
  Measured measure() const;
  void measure_creases();
  void measure_distance();
  /// True if nothing but the start determines the volumes.
  bool keeps_volumes() const {
    return own_boundary_ && !options_.fixed_boundary &&
           std::ranges::all_of(start_volumes_, [](double volume) { return volume > 0; });
  }
  double volume_change() const;
  bool changes_volumes() const { return volume_change() > options_.tuning.optimize.most_volume_change; }

  OptimizeOptions options_;
  VolumeMesh mesh_;
  MeshTopology topology_;
  bool own_boundary_;
  FitTarget target_;
  Interfaces interfaces_;  ///< between regions; fitted to themselves as they are at the start
  InterfaceMarks marks_;
  Held held_ = Held::nothing;
  std::vector<double> start_volumes_;  ///< of the regions
  std::vector<Vec3> ideal_boxes_;
  std::vector<double> weights_;  ///< per cell; empty: all equal
  std::vector<double> relief_;   ///< per cell, the factor on its weight that is lowered beside places too far off
  double mean_percent_ = 0, max_percent_ = 0;  ///< distances at the samples of the last stage
  FitReport report_;
  StageRunner runner_;

 private:
  std::vector<std::array<Index, 2>> tagged_edges() const;
  void sample_boundary();
  std::vector<std::uint8_t> vertices_of(std::span<const Index> cells) const;
  std::vector<std::uint8_t> fixed_vertices(Boundary boundary) const;
  std::unique_ptr<SurfaceTerm> surface_term(bool emphasize_far) const;
  void relieve_far_cells(std::span<const double> triangle_distances);

  std::vector<Index> face_groups_;  ///< `groups_of_sheets`; empty without interfaces
  FollowedCreases creases_;
  BoundarySamples samples_;
  std::vector<std::uint8_t> refined_;  ///< 1 for sample triangles at places that are too far off: they get more points
};

}  // namespace subvol::internal
