// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/stage_runner.h"

#include "fit/closest_point_energy.h"
#include "fit/surface_energy.h"
namespace subvol {

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
