// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/solver/minimizer_run.h"

#include "subvol/base/format.h"
#include "subvol/fit/solver/vector_math.h"

#include <utility>

namespace subvol::internal {

MinimizerRun::MinimizerRun(FitProblem& problem, std::vector<Vec3>& x, const MinimizerOptions& options)
    : problem_(problem), x_(x), options_(options) {
  if (options.begun) result_ = *options.begun;
  result_.stop = MinimizerStop::iteration_limit;
  for (auto* nodes : {&y_, &dy_, &y_trial_}) nodes->resize(problem.nodes.num_rows());
  for (auto* samples : {&z_, &dz_, &z_trial_}) samples->resize(problem.samples.num_rows());
  problem.apply_nodes(x, y_);
  problem.apply_samples(x, z_);
}

void MinimizerRun::restart() {
  if (problem_.surface) problem_.surface->forget();
  is_assigned_ = false;
  memory_.clear();
  uncertified_ = problem_.volume->uncertified(y_);
  if (options_.keep) options_.keep(x_, result_);
}

void MinimizerRun::take_step(double t, IterationRecord& record) {
  add_scaled(t, d_, x_);
  problem_.apply_nodes(x_, y_);
  problem_.apply_samples(x_, z_);
  uncertified_ = std::move(trial_uncertified_);
  record.surface_energy = trial_surface_;
  record.volume_energy = trial_volume_;
  record.step_length = t;
}

bool MinimizerRun::take_accelerated_step(double t, IterationRecord& record) {
  if (!options_.accelerates || !problem_.surface) return false;
  step_.assign(d_.size(), Vec3::Zero());
  add_scaled(t, d_, step_);
  memory_.add(x_, step_, linearized_.gradient());
  if (!memory_.find_step(step_)) return false;
  if (!accepts_accelerated(record)) {
    memory_.clear();
    return false;
  }
  record.step_length = 1;
  std::swap(x_, step_);
  std::swap(y_, y_trial_);
  std::swap(z_, z_trial_);
  return is_assigned_ = true;
}

bool MinimizerRun::accepts_accelerated(IterationRecord& record) {
  problem_.nodes.apply(step_, dy_);
  add_scaled(1, x_, step_);
  problem_.apply_nodes(step_, y_trial_);
  if (!admits_step(record)) return false;
  const double volume = problem_.volume->value(y_trial_);
  if (!(problem_.lambda * volume <= trial_)) return false;
  std::vector<Index> uncertified = problem_.volume->uncertified(y_trial_);
  if (!newly_failed(uncertified_, uncertified).empty()) return false;
  problem_.apply_samples(step_, z_trial_);
  problem_.surface->assign(z_trial_);
  const double surface = problem_.surface->value(z_trial_), energy = surface + problem_.lambda * volume;
  if (!(energy <= trial_)) return false;
  trial_ = energy;
  record.surface_energy = surface;
  record.volume_energy = volume;
  uncertified_ = std::move(uncertified);
  return true;
}

bool MinimizerRun::is_done(const IterationRecord& record) {
  if (!record_step(record, options_, result_)) return true;
  const double decrease = (energy_ - trial_) / energy_;
  result_.small_steps = decrease < options_.relative_decrease ? result_.small_steps + 1 : 0;
  if (result_.small_steps < 2) return false;
  result_.stop = MinimizerStop::converged;
  result_.explanation = formatted("relative decrease of the energy %.2g in two steps running", decrease);
  return true;
}

MinimizerResult MinimizerRun::end(MinimizerStop why, std::string explanation) {
  result_.stop = why;
  result_.explanation = std::move(explanation);
  return std::move(result_);
}

}  // namespace subvol::internal
