// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/stage_runner.h"

#include "fit/closest_point_energy.h"
#include "fit/surface_distance.h"
#include "fit/surface_energy.h"
#include "subvol/error.h"

#include <algorithm>
#include <cmath>

namespace subvol {

Normalisation::Normalisation(const TriangleMesh& target) {
  diagonal = bounding_box_diagonal(target);
  if (!(diagonal > 0) || !std::isfinite(diagonal))
    throw InputError("target: its triangles' bounding box has no extent, or coordinates are not finite");
  centre = TargetSurface(target).centre();
}

std::vector<Vec3> Normalisation::to_unit(std::vector<Vec3> points) const {
  for (Vec3& p : points) p = (p - centre) / diagonal;
  return points;
}

std::vector<Vec3> Normalisation::from_unit(std::vector<Vec3> points) const {
  for (Vec3& p : points) p = centre + diagonal * p;
  return points;
}

TriangleMesh normalised(TriangleMesh mesh, const Normalisation& normalisation) {
  mesh.positions = normalisation.to_unit(std::move(mesh.positions));
  return mesh;
}

TargetSurface sampled_target(const TriangleMesh& target, double area, std::size_t num_samples) {
  const double spacing = 1.8 * std::sqrt(area / static_cast<double>(std::max(num_samples, kLeastTargetSamples)));
  return TargetSurface(target, {.sample_spacing = spacing});
}

std::unique_ptr<SurfaceTerm> make_surface_term(const TargetSurface& target,
                                               const std::vector<std::array<Index, 3>>& sample_triangles,
                                               std::size_t num_samples, double tangential_weight,
                                               Correspondence correspondence) {
  if (correspondence == Correspondence::voronoi)
    return std::make_unique<SurfaceEnergy>(target, sample_triangles, num_samples, tangential_weight);
  const int points = sample_triangles.size() > 2 * target.triangles().size() ? 1 : 3;
  return std::make_unique<ClosestPointEnergy>(target, sample_triangles, num_samples, tangential_weight, points);
}

bool StageRunner::run(FitProblem& problem, const Stage& stage, StageRecord record, double fraction,
                      std::vector<Vec3>& x, FitReport& report) const {
  const double begin = seconds();
  record.lambda = stage.lambda;
  record.tangential_weight = stage.tangential_weight;
  record.unknowns = x.size();
  MinimizerOptions minimizer;
  minimizer.max_iterations = options_.max_iterations > 0 ? options_.max_iterations : stage.max_iterations;
  if (options_.solver == SolverKind::lbfgs && options_.max_iterations == 0) minimizer.max_iterations *= kLbfgsSteps;
  minimizer.relative_decrease = stage.relative_decrease;
  int iteration = 0;
  bool timed_out = false;
  minimizer.progress = [&](const IterationRecord& step) {
    timed_out = options_.time_limit_seconds > 0 && seconds() > options_.time_limit_seconds;
    const double energy = step.surface_energy + stage.lambda * step.volume_energy;
    const bool going = !options_.progress ||
                       options_.progress({record.name.c_str(), record.level, ++iteration, energy, fraction});
    return going && !timed_out;
  };
  const MinimizerResult solved = options_.solver == SolverKind::lbfgs ? minimize_lbfgs(problem, x, minimizer)
                                                                      : minimize_newton(problem, x, minimizer);
  record.iterations = solved.iterations;
  record.stop = solved.explanation;
  record.seconds = seconds() - begin;
  const std::string name = record.name;
  report.stages.push_back(std::move(record));
  if (solved.stop != MinimizerStop::cancelled) return true;
  report.stop_reason = timed_out ? StopReason::time_limit : StopReason::cancelled;
  report.explanation = (timed_out ? "time limit reached in " : "cancelled in ") + name;
  return false;
}

}  // namespace subvol
