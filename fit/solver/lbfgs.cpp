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
      : problem_(problem),
        nodes_(problem.nodes.num_rows()),
        samples_(problem.samples.num_rows()),
        node_gradient_(nodes_.size()),
        sample_gradient_(samples_.size()),
        from_samples_(problem.nodes.num_cols) {}

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

/// One minimization of x.
class Lbfgs {
 public:
  Lbfgs(FitProblem& problem, std::vector<Vec3>& x, const MinimizerOptions& options)
      : options_(options),
        objective_(problem),
        x_(x),
        gradient_(x.size()),
        trial_x_(x.size()),
        trial_gradient_(x.size()) {}

  MinimizerResult run() {
    value_ = objective_.evaluate(x_, gradient_);
    guard_ = objective_.certified(x_);
    if (!std::isfinite(value_.energy))
      return end(MinimizerStop::infeasible_start, "the start has a cell that is inverted at a quadrature point");
    double window_start = value_.energy;
    for (int iteration = 0; iteration < options_.max_iterations; ++iteration) {
      IterationRecord record;
      const std::vector<Vec3> d = direction(history_, gradient_);
      const double slope = dot(gradient_, d);
      if (!(slope < 0)) {
        if (dot(gradient_, gradient_) == 0) return end(MinimizerStop::converged, "the gradient vanishes");
        if (history_.empty()) return end(MinimizerStop::no_step, "there is no direction in which the energy decreases");
        history_.clear();
        continue;
      }
      const Search search = search_line(d, slope, record);
      if (search == Search::ended) return result_;
      if (search == Search::failed) {
        if (history_.empty())
          return end(MinimizerStop::no_step, "no step along the search direction decreases the energy");
        history_.clear();
        continue;
      }
      take_step();
      record.surface_energy = value_.surface;
      record.volume_energy = value_.volume;
      if (!record_step(record, options_, result_)) return result_;
      if ((iteration + 1) % kWindow != 0) continue;
      if (window_start - value_.energy < options_.relative_decrease * value_.energy)
        return end(MinimizerStop::converged, "small relative decrease of the energy in ten steps");
      window_start = value_.energy;
    }
    return result_;
  }

 private:
  enum class Search { accepted, failed, ended };

  MinimizerResult end(MinimizerStop stop, const char* explanation) {
    result_.stop = stop;
    result_.explanation = explanation;
    return result_;
  }

  /// Finds a step along d that meets the weak Wolfe conditions, by bisection; without the curvature condition once an
  /// upper end is known. +infinity fails Armijo's condition, so that the upper end closes in on the feasible part.
  /// The trial is at the end of the accepted step.
  Search search_line(const std::vector<Vec3>& d, double slope, IterationRecord& record) {
    double low = 0, high = std::numeric_limits<double>::infinity();
    double t = history_.empty() ? std::min(1.0, 1e-3 * std::sqrt(dot(x_, x_) / dot(d, d))) : 1;
    for (int k = 0; k < kMaxTrials; ++k) {
      if (has_ended(options_, result_)) return Search::ended;
      for (std::size_t i = 0; i < x_.size(); ++i) trial_x_[i] = x_[i] + t * d[i];
      trial_ = objective_.evaluate(trial_x_, trial_gradient_);
      ++record.evaluations;
      if (!(trial_.energy <= value_.energy + kArmijo * t * slope) || (guard_ && !objective_.certified(trial_x_))) {
        high = t;
      } else if (dot(trial_gradient_, d) < kWolfe * slope && k + 1 < kMaxTrials && std::isinf(high)) {
        low = t;
      } else {
        record.step_length = t;
        return Search::accepted;
      }
      t = std::isinf(high) ? 2 * low : 0.5 * (low + high);
    }
    return Search::failed;
  }

  /// Goes to the trial, and remembers the step.
  void take_step() {
    Pair pair{trial_x_, trial_gradient_, 0};
    add_scaled(-1, x_, pair.s);
    add_scaled(-1, gradient_, pair.y);
    const double sy = dot(pair.s, pair.y);
    if (sy > 1e-300) {
      pair.rho = 1 / sy;
      history_.push_back(std::move(pair));
      if (history_.size() > kHistory) history_.pop_front();
    }
    x_ = trial_x_;
    gradient_ = trial_gradient_;
    value_ = trial_;
  }

  const MinimizerOptions& options_;
  MinimizerResult result_{MinimizerStop::iteration_limit, "iteration limit", {}};
  Objective objective_;
  std::vector<Vec3>& x_;
  std::vector<Vec3> gradient_, trial_x_, trial_gradient_;
  std::deque<Pair> history_;
  Value value_, trial_;
  bool guard_ = false;  ///< true if no step may lose the certificate that the start has
};

}  // namespace

MinimizerResult minimize_lbfgs(FitProblem& problem, std::vector<Vec3>& x, const MinimizerOptions& options) {
  return Lbfgs(problem, x, options).run();
}

}  // namespace subvol::internal
