// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/solver/newton.h"

#include "subvol/fit/solver/minimizer_run.h"
#include "subvol/fit/solver/vector_math.h"

#include <cmath>
#include <utility>

namespace subvol::internal {

namespace {

/// Steps below this share of a whole one mean that the model of the energy is poor.
constexpr double kShortStep = 0.5;
/// Steps after which everything but x is forgotten, so that an interrupted minimization can be resumed from x.
constexpr int kRestartPeriod = 8;
/// Slopes below this are rounding; dimensionless, like E.
constexpr double kSlopeRounding = 1e-26;

/// One minimization by Newton's method.
class NewtonRun : MinimizerRun {
 public:
  NewtonRun(FitProblem& problem, std::vector<Vec3>& x, const MinimizerOptions& options);
  MinimizerResult run();

 private:
  enum class Search {
    found,         ///< a step was found
    stiffer,       ///< no step: cells block it; they are stiffer now
    no_step,       ///< no step is acceptable
    level,         ///< no line search: the gradient is numerically zero
    no_direction,  ///< no line search: there is no direction in which the energy decreases, though it has a gradient
    ended          ///< stopped by the caller
  };

  /// Finds a direction and a step along it. If the step would be short, makes the Hessian stiffer and tries again.
  Search find_step(IterationRecord& record);
  bool find_direction(IterationRecord& record);
  /// Returns true if the gradient is zero up to rounding.
  bool has_no_gradient() const;
  /// Finds the longest of t, t / 2, ... that decreases E and leaves no further cell uncertified. If cells were
  /// uncertified at a longer one, it is halved once more (`VolumeTerm::keeps_off_inversion`).
  Search search_line(bool may_stiffen, IterationRecord& record);
  bool admits_step(IterationRecord& record) override;

  double slope_ = 0, t_ = 0;     // along d_, and the share of d_ that is taken
  std::vector<Index> blocking_;  // cells that blocked this step
  bool is_stiffened_ = false;    // true if the Hessian was made stiffer for this step
};

NewtonRun::NewtonRun(FitProblem& problem, std::vector<Vec3>& x, const MinimizerOptions& options)
    : MinimizerRun(problem, x, options) {
  densify_again(problem, result_);
  uncertified_ = problem.volume->uncertified(y_);
}

bool NewtonRun::find_direction(IterationRecord& record) {
  ReducedHessian reduced(problem_);
  if (inverse_diagonal_.empty()) inverse_diagonal_ = inverse_blocks(reduced.diagonal(), problem_.projectors);
  record.linear_iterations += conjugate_gradients(reduced, inverse_diagonal_, linearized_.gradient(), options_, d_);
  slope_ = dot(linearized_.gradient(), d_);
  return slope_ < -kSlopeRounding;
}

bool NewtonRun::has_no_gradient() const {
  double decrease = 0;  // that the preconditioner foretells
  for (std::size_t j = 0; j < inverse_diagonal_.size(); ++j) {
    const Vec3& g = linearized_.gradient()[j];
    decrease += inverse_diagonal_[j].isZero(0) ? g.squaredNorm() : g.dot(inverse_diagonal_[j] * g);
  }
  return decrease <= kSlopeRounding;
}

NewtonRun::Search NewtonRun::find_step(IterationRecord& record) {
  blocking_.clear();
  is_stiffened_ = false;
  for (int round = 0;; ++round) {
    const bool downhill = find_direction(record);
    if (has_ended(options_, result_)) return Search::ended;
    if (!downhill) return has_no_gradient() ? Search::level : Search::no_direction;
    problem_.nodes.apply(d_, dy_);
    t_ = problem_.volume->max_step(y_, dy_);
    // Points that limit the whole step this much had better stay where they are.
    const bool may_stiffen = round < options_.most_stiffenings;
    if (!may_stiffen || t_ >= kShortStep || !problem_.volume->stiffen(y_, dy_, kShortStep)) {
      const Search found = search_line(may_stiffen, record);
      if (found != Search::stiffer) return found;
    }
    inverse_diagonal_.clear();
    is_stiffened_ = true;
  }
}

NewtonRun::Search NewtonRun::search_line(bool may_stiffen, IterationRecord& record) {
  constexpr int kMaxHalvings = 30;  // a step of 1e-9 is none
  problem_.multiply_samples(d_, dz_);
  bool cut_back = false, drawn_back = !problem_.volume->keeps_off_inversion();
  for (int halving = 0; halving < kMaxHalvings; ++halving, t_ *= 0.5) {
    if (has_ended(options_, result_)) return Search::ended;
    for (std::size_t i = 0; i < y_.size(); ++i) y_trial_[i] = y_[i] + t_ * dy_[i];
    for (std::size_t i = 0; i < z_.size(); ++i) z_trial_[i] = z_[i] + t_ * dz_[i];
    ++record.evaluations;
    trial_surface_ = problem_.surface ? problem_.surface->value(z_trial_) : 0;
    trial_volume_ = problem_.volume->value(y_trial_);
    trial_ = trial_surface_ + problem_.lambda * trial_volume_;
    if (!(trial_ <= energy_ + kArmijo * t_ * slope_)) continue;
    trial_uncertified_ = problem_.volume->uncertified(y_trial_);
    const std::vector<Index> failed = newly_failed(uncertified_, trial_uncertified_);
    blocking_.insert(blocking_.end(), failed.begin(), failed.end());
    if (failed.empty()) {
      if (!cut_back || drawn_back) return Search::found;
      drawn_back = true;
    } else {
      if (may_stiffen && problem_.volume->stiffen(failed)) return Search::stiffer;
      cut_back = true;
    }
  }
  return Search::no_step;
}

bool NewtonRun::admits_step(IterationRecord& record) {
  ++record.evaluations;
  return problem_.volume->max_step(y_, dy_) >= 1;
}

MinimizerResult NewtonRun::run() {
  bool is_refined = false;  // the quadrature of cells, since the Hessian was computed
  for (int iteration = static_cast<int>(result_.iterations.size()); iteration < options_.max_iterations; ++iteration) {
    const bool restarts = iteration % kRestartPeriod == 0;
    if (iteration > 0 && restarts) {
      inverse_diagonal_.clear();
      restart();
    }
    const bool is_old = iteration < 2 || restarts || iteration % options_.hessian_life == 0 || is_stiffened_ ||
                        is_refined || t_ < kShortStep;
    energy_ = linearized_.linearize(problem_, y_, z_, !is_old, is_assigned_);
    is_assigned_ = false;
    is_refined = false;
    if (!std::isfinite(energy_))
      return end(MinimizerStop::infeasible_start, "the start has a cell that is inverted at a quadrature point");
    if (iteration < 2 || is_stiffened_) inverse_diagonal_.clear();  // later it changes slowly
    IterationRecord record;
    const Search found = find_step(record);
    if (found == Search::ended) return std::move(result_);
    if (found == Search::level) return end(MinimizerStop::converged, "the gradient vanishes");
    if (found == Search::no_direction)
      return end(MinimizerStop::no_step, "the second derivatives give no direction in which the energy decreases");
    if (!blocking_.empty()) {
      is_refined = true;
      memory_.clear();  // the steps before lowered another E
      problem_.volume->densify(blocking_, y_);
      result_.densified.push_back(std::move(blocking_));
      result_.densified_at = x_;
    }
    if (found == Search::no_step)
      return end(MinimizerStop::no_step, "no step along the search direction decreases the energy");
    if (is_refined || !take_accelerated_step(t_, record)) take_step(t_, record);
    if (is_done(record)) return std::move(result_);
  }
  return end(MinimizerStop::iteration_limit, "iteration limit");
}

}  // namespace

MinimizerResult minimize_newton(FitProblem& problem, std::vector<Vec3>& x, const MinimizerOptions& options) {
  return NewtonRun(problem, x, options).run();
}

}  // namespace subvol::internal
