// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/solver/lbfgs.h"

#include "subvol/fit/solver/vector_math.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>

namespace subvol::internal {

namespace {

/// Pairs of steps and changes of the gradient that are kept, steps over which the decrease is judged, and evaluations
/// of one line search.
constexpr int kHistory = 10, kWindow = 10, kMaxTrials = 40;
constexpr double kWolfe = 0.9;  // the usual factor on the slope for quasi-Newton methods

struct Value {
  double surface = 0, volume = 0, energy = std::numeric_limits<double>::infinity();
};

/// E and its gradient over the degrees of freedom. Correspondences are found anew at each evaluation; the gradient
/// takes them as frozen.
class Objective {
 public:
  explicit Objective(FitProblem& problem)
      : problem_(problem), nodes_(problem.nodes.num_rows()), samples_(problem.samples.num_rows()),
        node_gradient_(nodes_.size()), sample_gradient_(samples_.size()), from_samples_(problem.nodes.num_cols) {}

  Value evaluate(std::span<const Vec3> x, std::span<Vec3> gradient) {
    problem_.apply_nodes(x, nodes_);
    std::fill(node_gradient_.begin(), node_gradient_.end(), Vec3::Zero());
    Value value;
    value.volume = problem_.volume->add_gradient(nodes_, problem_.lambda, node_gradient_);
    if (!std::isfinite(value.volume)) return value;
    if (problem_.surface) value.surface = evaluate_surface(x);
    value.energy = value.surface + problem_.lambda * value.volume;
    problem_.nodes_transposed.apply(node_gradient_, gradient);
    if (problem_.surface) add_scaled(1, from_samples_, gradient);
    return value;
  }

  bool certified(std::span<const Vec3> x) {
    problem_.apply_nodes(x, nodes_);
    return problem_.volume->uncertified(nodes_).empty();
  }

 private:
  /// Returns E_S; from_samples_ receives its gradient over the degrees of freedom.
  double evaluate_surface(std::span<const Vec3> x) {
    problem_.apply_samples(x, samples_);
    problem_.surface->assign(samples_);
    std::fill(sample_gradient_.begin(), sample_gradient_.end(), Vec3::Zero());
    problem_.surface->add_gradient(samples_, sample_gradient_);
    problem_.pull_back_samples(sample_gradient_, from_samples_);
    return problem_.surface->value(samples_);
  }

  FitProblem& problem_;
  std::vector<Vec3> nodes_, samples_, node_gradient_, sample_gradient_, from_samples_;
};

struct Pair {
  std::vector<Vec3> s, y;
  double rho;
};

/// Two-loop recursion: d = -H g.
std::vector<Vec3> direction(const std::deque<Pair>& history, const std::vector<Vec3>& gradient) {
  std::vector<Vec3> d = gradient;
  std::vector<double> alpha(history.size());
  for (std::size_t i = history.size(); i-- > 0;) {
    alpha[i] = history[i].rho * dot(history[i].s, d);
    add_scaled(-alpha[i], history[i].y, d);
  }
  if (!history.empty()) {
    const double scale = 1 / (history.back().rho * dot(history.back().y, history.back().y));
    for (Vec3& p : d) p *= scale;
  }
  for (std::size_t i = 0; i < history.size(); ++i)
    add_scaled(alpha[i] - history[i].rho * dot(history[i].y, d), history[i].s, d);
  for (Vec3& p : d) p = -p;
  return d;
}

}  // namespace

MinimizerResult minimize_lbfgs(FitProblem& problem, std::vector<Vec3>& x, const MinimizerOptions& options) {
  MinimizerResult result{MinimizerStop::iteration_limit, "iteration limit", {}};
  Objective objective(problem);
  std::vector<Vec3> gradient(x.size()), trial_x(x.size()), trial_gradient(x.size());
  std::deque<Pair> history;
  Value value = objective.evaluate(x, gradient);
  const bool guard = objective.certified(x);
  if (!std::isfinite(value.energy)) {
    result.stop = MinimizerStop::infeasible_start;
    result.explanation = "the start has a cell that is inverted at a quadrature point";
    return result;
  }
  double window_start = value.energy;
  for (int iteration = 0; iteration < options.max_iterations; ++iteration) {
    IterationRecord record;
    std::vector<Vec3> d = direction(history, gradient);
    double slope = dot(gradient, d);
    if (!(slope < 0)) {
      const bool vanishes = dot(gradient, gradient) == 0;
      if (!vanishes && !history.empty()) {
        history.clear();
        continue;
      }
      result.stop = vanishes ? MinimizerStop::converged : MinimizerStop::no_step;
      result.explanation = vanishes ? "the gradient vanishes" : "there is no direction in which the energy decreases";
      return result;
    }
    // Weak Wolfe conditions by bisection, without the curvature condition once an upper end is known. +infinity fails
    // Armijo's condition, so that the upper end closes in on the feasible part.
    double low = 0, high = std::numeric_limits<double>::infinity();
    double t = history.empty() ? std::min(1.0, 1e-3 * std::sqrt(dot(x, x) / dot(d, d))) : 1;
    Value trial;
    bool accepted = false;
    for (int k = 0; k < kMaxTrials && !accepted; ++k) {
      if (has_ended(options, result)) return result;
      for (std::size_t i = 0; i < x.size(); ++i) trial_x[i] = x[i] + t * d[i];
      trial = objective.evaluate(trial_x, trial_gradient);
      ++record.evaluations;
      if (!(trial.energy <= value.energy + kArmijo * t * slope) || (guard && !objective.certified(trial_x)))
        high = t;
      else if (dot(trial_gradient, d) < kWolfe * slope && k + 1 < kMaxTrials && std::isinf(high))
        low = t;
      else
        accepted = true;
      if (!accepted) t = std::isinf(high) ? 2 * low : 0.5 * (low + high);
    }
    if (!accepted) {
      if (history.empty()) {
        result.stop = MinimizerStop::no_step;
        result.explanation = "no step along the search direction decreases the energy";
        return result;
      }
      history.clear();
      continue;
    }
    Pair pair{trial_x, trial_gradient, 0};
    add_scaled(-1, x, pair.s);
    add_scaled(-1, gradient, pair.y);
    const double sy = dot(pair.s, pair.y);
    if (sy > 1e-300) {
      pair.rho = 1 / sy;
      history.push_back(std::move(pair));
      if (history.size() > kHistory) history.pop_front();
    }
    x = trial_x;
    gradient = trial_gradient;
    value = trial;
    record.surface_energy = value.surface;
    record.volume_energy = value.volume;
    record.step_length = t;
    if (!record_step(record, options, result)) return result;
    if ((iteration + 1) % kWindow != 0) continue;
    if (window_start - value.energy < options.relative_decrease * value.energy) {
      result.stop = MinimizerStop::converged;
      result.explanation = "small relative decrease of the energy in ten steps";
      return result;
    }
    window_start = value.energy;
  }
  return result;
}

}  // namespace subvol::internal
