// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/stages/stage_runner.h"

#include "subvol/base/fingerprint.h"
#include "subvol/base/format.h"
#include "subvol/fit/geometry/self_intersection.h"
#include "subvol/fit/solver/lbfgs.h"
#include "subvol/fit/solver/levenberg_marquardt.h"
#include "subvol/fit/solver/newton.h"

#include <algorithm>

namespace subvol::internal {

namespace {

/// Relative tolerance of the linear systems of the Levenberg-Marquardt method, which are well conditioned.
constexpr double kLeastSquaresTolerance = 0.05;

std::uint64_t start_of(const FitProblem& problem, const MinimizerOptions& minimizer, std::span<const Vec3> x) {
  Fingerprint start;
  start.add(problem.lambda).add(minimizer.max_iterations).add(minimizer.relative_decrease);
  start.add(problem.nodes.num_rows()).add(problem.samples.num_rows());
  return start.add(std::span<const double>(x.empty() ? nullptr : x.front().data(), 3 * x.size())).value();
}

}  // namespace

bool StageRunner::run(FitProblem& problem, const Stage& stage, StageRecord record, std::vector<Vec3>& x,
                      FitReport& report, double step_work) const {
  record.lambda = stage.lambda;
  record.tangential_weight = stage.tangential_weight;
  record.unknowns = x.size();
  record.raises_quality = stage.longest_move > 0;
  MinimizerOptions minimizer;
  minimizer.max_iterations = control_.max_iterations > 0 ? control_.max_iterations : stage.max_iterations;
  if (stage.longest_move > 0) minimizer.max_iterations = std::min(minimizer.max_iterations, stage.max_iterations);
  if (solver_ == SolverKind::lbfgs && control_.max_iterations == 0 && stage.longest_move == 0)
    minimizer.max_iterations *= kLbfgsSteps;
  minimizer.relative_decrease = stage.relative_decrease;
  minimizer.longest_move = stage.longest_move;
  minimizer.first_damping = stage.first_damping;
  minimizer.spares_most = stage.spares_most;
  minimizer.cg_tolerance = stage.linear_tolerance;
  minimizer.hessian_life = stage.hessian_life;
  minimizer.accelerates = stage.accelerates;
  minimizer.damping = tuning_.quality;
  minimizer.most_stiffenings = tuning_.curved.most_stiffenings;
  if (stage.longest_move > 0) minimizer.cg_tolerance = kLeastSquaresTolerance;
  int iteration = 0;
  minimizer.ended = [this] { return is_to_end(); };
  minimizer.progress = [&](const IterationRecord& step) {
    const double energy = step.surface_energy + stage.lambda * step.volume_energy;
    work_->add(step_work);
    const bool wanted = !control_.progress ||
                        control_.progress({record.name.c_str(), record.level, ++iteration, energy, work_->share()});
    return wanted && !is_over();
  };
  // A stage recalled from a log leaves no correspondences behind, so those left by a solved stage must not matter
  // either.
  if (problem.surface) problem.surface->forget();
  SolvedStage solved{record.name, control_.log ? start_of(problem, minimizer, x) : 0, x, {}, 0};
  const SolvedStage* known = control_.log ? control_.log->recall(solved) : nullptr;
  if (known) solved = *known;
  bool going = true;
  if (!known || !known->is_over()) {
    iteration = static_cast<int>(solved.result.iterations.size());
    solve(problem, minimizer, solved);
    going = solved.is_over();
  } else {
    densify_again(problem, solved.result);
    if (!solved.result.iterations.empty()) going = minimizer.progress(solved.result.iterations.back());
  }
  x = std::move(solved.x);
  record.seconds = solved.seconds;
  record.iterations = std::move(solved.result.iterations);
  record.ended = solved.result.stop;
  record.stop = std::move(solved.result.explanation);
  const std::string name = record.name;
  report.stages.push_back(std::move(record));
  if (!going) give_up(name, report);
  return going;
}

void StageRunner::give_up(const std::string& work, FitReport& report) const {
  if (!in_time(work, report)) return;
  report.stop_reason = StopReason::cancelled;
  report.explanation = "cancelled in " + work;
}

std::optional<std::size_t> StageRunner::intersecting_pairs(const TriangleMesh& boundary, FitReport& report,
                                                           std::span<const std::uint8_t> marked) const {
  bool ended = false;
  const SelfIntersections found = self_intersections(
      boundary, [&] { return ended = ended || is_to_end(); }, marked);
  if (!ended) return found.pairs.size();
  give_up("the search for self-intersections", report);
  return {};
}

bool StageRunner::in_time(const std::string& work, FitReport& report) const {
  if (!is_over()) return true;
  report.stop_reason = StopReason::time_limit;
  report.explanation = "time limit reached in " + work;
  return false;
}

void StageRunner::conclude(double mean_percent, std::optional<double> tolerance_percent, FitReport& report) const {
  constexpr double kFarPercent = 10;  // of the diagonal, on the mean; results of templates in their place are below 1 %
  if (mean_percent > kFarPercent)
    report.warnings.push_back(formatted(
        "the result is far from its target, %.3g %% on the mean: is the template roughly in place?", mean_percent));
  // Quality stages end after a few steps by themselves; what comes before them tells whether steps ran out.
  const auto found = std::find_if(report.stages.rbegin(), report.stages.rend(),
                                  [](const StageRecord& stage) { return stage.kept && !stage.raises_quality; });
  const StageRecord* last = found == report.stages.rend() ? nullptr : &*found;
  if (last && last->ended == MinimizerStop::infeasible_start) {
    report.stop_reason = StopReason::stalled;
    report.explanation = last->name + " could not begin: " + last->stop;
  } else if (!tolerance_percent && last && last->ended == MinimizerStop::iteration_limit &&
             control_.max_iterations > 0) {
    report.stop_reason = StopReason::iteration_limit;
    report.explanation = formatted("%s took all of the %d steps allowed, mean distance %.4g %%", last->name.c_str(),
                                   control_.max_iterations, mean_percent);
  } else {
    conclude_by_distance(mean_percent, tolerance_percent, report);
  }
}

void conclude_by_distance(double mean_percent, std::optional<double> tolerance_percent, FitReport& report) {
  if (tolerance_percent && mean_percent > *tolerance_percent) {
    report.stop_reason = StopReason::tolerance_missed;
    report.explanation =
        formatted("mean distance %.4g %% is above the tolerance of %.4g %%", mean_percent, *tolerance_percent);
  } else {
    report.stop_reason = StopReason::converged;
    report.explanation = formatted("all stages done, mean distance %.4g %%", mean_percent);
  }
}

void StageRunner::solve(FitProblem& problem, MinimizerOptions minimizer, SolvedStage& stage) const {
  const double begin = seconds() - stage.seconds;
  const MinimizerResult begun = stage.result;
  if (!begun.iterations.empty()) minimizer.begun = &begun;
  if (control_.log)
    minimizer.keep = [&](std::span<const Vec3> x, const MinimizerResult& so_far) {
      SolvedStage kept{stage.name, stage.start, std::vector<Vec3>(x.begin(), x.end()), so_far, seconds() - begin};
      kept.result.stop = MinimizerStop::cancelled;
      control_.log->add(std::move(kept));
    };
  const auto minimize = minimizer.longest_move > 0     ? minimize_levenberg_marquardt
                        : solver_ == SolverKind::lbfgs ? minimize_lbfgs
                                                       : minimize_newton;
  stage.result = minimize(problem, stage.x, minimizer);
  stage.seconds = seconds() - begin;
  if (control_.log && stage.is_over()) control_.log->add(stage);
}

}  // namespace subvol::internal
