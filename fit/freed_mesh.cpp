// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/freed_mesh.h"

#include "subvol/base/format.h"
#include "subvol/fit/geometry/boundary_triangles.h"
#include "subvol/fit/geometry/self_intersection.h"
#include "subvol/fit/geometry/surface_distance.h"
#include "subvol/fit/optimize_mesh.h"
#include "subvol/fit/quality/quality.h"
#include "subvol/fit/stages/stage_runner.h"
#include "subvol/mesh/interfaces.h"
#include "subvol/mesh/mesh_topology.h"
#include "subvol/surface/boundary.h"
#include "subvol/surface/triangle_geometry.h"
#include "subvol/templates/pillow.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <new>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace subvol::internal {

namespace {

/// Largest distance from the target, in percent of its diagonal, at which a mesh is freed: one farther off is not in
/// place.
constexpr double kMostFreedPercent = 50;

/// Frees the mesh of one fit: makes the attempts, and puts the best mesh in the place of the fit's.
class MeshFreeing {
 public:
  MeshFreeing(const TriangleMesh& target, const FitOptions& options, FitResult& result)
      : target_(target),
        options_(options),
        result_(result),
        runner_(options.control, SolverKind::newton, options.tuning),
        start_(measure_state(result.mesh, target)) {
    best_ = start_;
  }
  void run(const VolumeMesh& lifted);

 private:
  bool is_too_far(const MeshState& now) const;
  bool reaches_the_finest_level() const;
  bool gains(const MeshState& now) const;
  bool attempt(VolumeMesh mesh, double begin, double end);
  std::optional<MeshState> optimize(VolumeMesh& mesh, double distance_share, SolveControl control);
  void try_to_free(const VolumeMesh& lifted);
  void conclude();

  const TriangleMesh& target_;
  const FitOptions& options_;
  FitResult& result_;
  StageRunner runner_;  ///< its clock began with the freeing
  MeshState start_, best_;
  std::optional<VolumeMesh> freed_;
  FitReport found_;  ///< of freed_
};

/// Returns true if a state is too far from the target.
bool MeshFreeing::is_too_far(const MeshState& now) const {
  const std::optional<double>& tolerance = options_.tolerance_percent;
  return (tolerance && now.mean_percent > *tolerance && now.mean_percent > start_.mean_percent) ||
         now.is_farther_than(start_, options_.tuning.quality.most_rise);
}

/// Returns true if a state is better than the best one: validity counts first, then the least scaled Jacobian.
bool MeshFreeing::gains(const MeshState& now) const {
  if (is_too_far(now) || now.uncertified > best_.uncertified || now.pairs > best_.pairs) return false;
  return now.uncertified < best_.uncertified || now.pairs < best_.pairs || now.least_jacobian > best_.least_jacobian;
}

/// Optimizes a mesh with all of its vertices and keeps it if it is better. Returns false if the work must end.
bool MeshFreeing::attempt(VolumeMesh mesh, double begin, double end) {
  const double middle = (begin + end) / 2;
  const std::size_t first = result_.report.stages.size();
  const MeshState before = best_;
  std::optional<MeshState> now =
      optimize(mesh, options_.tuning.quality.most_rise, part_of_work(options_.control, begin, middle));
  if (now && is_too_far(*now))
    now = optimize(mesh, options_.tuning.quality.nearer_share, part_of_work(options_.control, middle, end));
  if (best_ == before) result_.report.undo_stages(first, result_.report.stages.size());
  return now.has_value();
}

/// Optimizes a mesh within a share of the cage's distances, and keeps it if it is better. Returns its new state, or
/// nothing if the work must end.
std::optional<MeshState> MeshFreeing::optimize(VolumeMesh& mesh, double distance_share, SolveControl control) {
  constexpr double kLeastTolerance = 1e-6, kMostTolerance = 100;  // percent
  constexpr double kLeastSeconds = 1e-3;
  if (!runner_.in_time("the freeing of the mesh", result_.report)) return std::nullopt;
  const auto tolerance = [&](double percent) {
    return std::clamp(distance_share * percent, kLeastTolerance, kMostTolerance);
  };
  OptimizeOptions options{.quality = options_.quality,
                          .mean_tolerance_percent = tolerance(start_.mean_percent),
                          .max_tolerance_percent = tolerance(start_.max_percent),
                          .control = std::move(control),
                          .tuning = options_.tuning};
  // As in the fit: without an angle, only the template's own creases are sharp.
  const double usual_angle = mesh.tags.creases.empty() ? kNoCreaseAngle : kUsualCreaseAngle;
  options.crease_angle_degrees = options_.crease_angle_degrees.value_or(usual_angle);
  if (double& limit = options.control.time_limit_seconds; limit > 0)
    limit = std::max(kLeastSeconds, limit - runner_.seconds());
  OptimizeResult optimized = optimize_mesh(mesh, &target_, options);
  mesh = std::move(optimized.mesh);
  FitReport& report = optimized.report;
  for (StageRecord& stage : report.stages) {
    stage.name = "vertices freed, " + stage.name;
    result_.report.stages.push_back(std::move(stage));
  }
  const bool ended = ended_early(report.stop_reason);
  if (ended) {
    result_.report.stop_reason = report.stop_reason;
    result_.report.explanation = report.explanation;
  }
  const MeshState now = measure_state(mesh, target_);
  if (gains(now)) {
    best_ = now;
    freed_ = mesh;
    found_ = std::move(report);
  }
  return ended ? std::nullopt : std::optional(now);
}

/// Returns true if the finest level, which the cage could not reach, is reached by the freed mesh. Returns
/// false if the number of steps was limited, because the cage may have needed more steps.
bool MeshFreeing::reaches_the_finest_level() const {
  return options_.control.max_iterations == 0 && result_.report.stop_reason == StopReason::stalled &&
         result_.level == options_.levels && best_.is_valid() &&
         best_.mean_percent <= options_.tuning.quality.reached_share * best_.face_percent;
}

/// Makes the best mesh the result, if it is not the cage's.
void MeshFreeing::conclude() {
  if (!freed_) return;
  FitReport& report = result_.report;
  const std::size_t layer = freed_->num_cells() - result_.mesh.num_cells();
  const StopReason reason = report.stop_reason;
  if (reason == StopReason::converged || reason == StopReason::tolerance_missed || reaches_the_finest_level())
    conclude_by_distance(best_.mean_percent, options_.tolerance_percent, report);
  report.explanation += "; all vertices were freed from the cage";
  if (layer > 0) report.explanation += formatted(", with a layer of %zu cells inside the boundary", layer);
  if (report.stop_reason != StopReason::converged)
    report.explanation += formatted(", mean distance %.4g %%", best_.mean_percent);
  report.creases = found_.creases;
  report.warnings.insert(report.warnings.end(), found_.warnings.begin(), found_.warnings.end());
  result_.mesh = std::move(*freed_);
  result_.cage = {};
  result_.states.clear();
}

/// Makes the attempts. If memory runs out in one, what was kept before stays.
void MeshFreeing::try_to_free(const VolumeMesh& lifted) {
  constexpr double kFirstFreeingWorkShare = 0.5;  // in the first attempt
  const bool is_lifted = lifted.num_cells() == result_.mesh.num_cells() &&
                         measure_quality(lifted).min_scaled_jacobian > start_.least_jacobian;
  const VolumeMesh& start = is_lifted ? lifted : result_.mesh;
  try {
    if (!attempt(start, 0, kFirstFreeingWorkShare)) return;
    if (best_.is_valid() && best_.least_jacobian >= options_.tuning.quality.layer_below * options_.quality) return;
    attempt(pillow(freed_ ? *freed_ : start, {}, InvertedCells::allowed), kFirstFreeingWorkShare, 1);
  } catch (const std::bad_alloc&) {
    result_.report.stop_reason = StopReason::memory_limit;
    result_.report.explanation = "no memory was left to free the mesh from its cage";
  }
}

void MeshFreeing::run(const VolumeMesh& lifted) {
  if (start_.least_jacobian >= options_.quality || start_.max_percent > kMostFreedPercent) return;
  try_to_free(lifted);
  conclude();
  result_.report.seconds.emplace_back("freeing", runner_.seconds());
}

}  // namespace

bool MeshState::is_farther_than(const MeshState& other, double most_rise) const {
  return mean_percent > most_rise * other.mean_percent || max_percent > most_rise * other.max_percent;
}

MeshState measure_state(const VolumeMesh& mesh, const TriangleMesh& target) {
  const QualityReport quality = measure_quality(mesh);
  const MeshTopology topology(mesh);
  const TriangleMesh surface = refined_triangles(boundary_surface(mesh, topology));
  const SurfaceDistance distance = surface_distance(surface, target);
  const double to_percent = 100 / bounding_box_diagonal(target);
  double area = 0;
  for (const auto& triangle : surface.triangles) area += triangle_area(surface, triangle);
  const double faces = static_cast<double>(topology.boundary_faces().size());
  return {quality.min_scaled_jacobian,
          to_percent * distance.mean(),
          to_percent * distance.max(),
          to_percent * std::sqrt(area / faces),
          quality.certificate.not_certified.size(),
          count_intersecting_pairs(surface)};
}

bool can_be_freed(const VolumeMesh& template_mesh, const FitOptions& options) {
  return options.quality > 0 && !options.keeps_groups && region_references(template_mesh).size() <= 1;
}

void free_mesh(const TriangleMesh& target, const FitOptions& options, const VolumeMesh& lifted, FitResult& result) {
  if (ended_early(result.report.stop_reason)) return;
  MeshFreeing(target, options, result).run(lifted);
}

}  // namespace subvol::internal
