// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/fit_problem.h"
#include "fit/vector_math.h"
#include "subvol/error.h"

#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

namespace subvol {

FitProblem::FitProblem(SparseMap node_map, SparseMap sample_map, std::unique_ptr<VolumeTerm> volume_energy,
                       std::unique_ptr<SurfaceTerm> surface_energy, double volume_weight)
    : nodes(std::move(node_map)),
      nodes_transposed(transposed(nodes)),
      samples(std::move(sample_map)),
      samples_transposed(transposed(samples)),
      volume(std::move(volume_energy)),
      surface(std::move(surface_energy)),
      lambda(volume_weight) {}

void FitProblem::apply_nodes(std::span<const Vec3> x, std::span<Vec3> out) const {
  nodes.apply(x, out);
  if (!fixed_nodes.empty()) add_scaled(1, fixed_nodes, out);
}

void FitProblem::apply_samples(std::span<const Vec3> x, std::span<Vec3> out) const {
  multiply_samples(x, out);
  if (!fixed_samples.empty()) add_scaled(1, fixed_samples, out);
}

void FitProblem::multiply_samples(std::span<const Vec3> d, std::span<Vec3> out) const {
  tables ? tables->apply(d, out) : samples.apply(d, out);
}

void FitProblem::pull_back_samples(std::span<const Vec3> g, std::span<Vec3> out) const {
  tables ? tables->apply_transposed(g, out) : samples_transposed.apply(g, out);
}

namespace {

/// The pulled-back Hessian M^T H_W M + N^T H_S N with its block-Jacobi preconditioner.
class ReducedHessian {
 public:
  /// inverse_diagonal  of an earlier Hessian of the same problem, to be used again; empty: computed.
  ReducedHessian(const FitProblem& problem, std::vector<Mat3>& inverse_diagonal)
      : problem_(problem),
        inverse_diagonal_(inverse_diagonal),
        node_in_(problem.nodes.num_rows()),
        node_out_(problem.nodes.num_rows()),
        sample_in_(problem.samples.num_rows()),
        sample_out_(problem.samples.num_rows()),
        from_samples_(problem.nodes.num_cols) {
    if (!inverse_diagonal_.empty()) return;
    inverse_diagonal_.assign(problem.nodes.num_cols, Mat3::Zero());
    problem.volume->add_diagonal_blocks(problem.nodes, problem.nodes_transposed, inverse_diagonal_);
    if (problem.surface)
      add_diagonal_blocks(problem.samples, problem.samples_transposed, problem.surface->hessian(), inverse_diagonal_);
#pragma omp parallel for schedule(static)
    for (std::size_t j = 0; j < inverse_diagonal_.size(); ++j) {
      // Vertices of no cell have no energy: they stay.
      const Mat3 block = inverse_diagonal_[j];
      inverse_diagonal_[j] = block.trace() > 0 ? Mat3(block.inverse()) : Mat3(Mat3::Zero());
    }
  }

  void multiply(std::span<const Vec3> in, std::span<Vec3> out) {
    problem_.nodes.apply(in, node_in_);
    problem_.volume->multiply(node_in_, node_out_);
    problem_.nodes_transposed.apply(node_out_, out);
    if (!problem_.surface) return;
    problem_.multiply_samples(in, sample_in_);
    problem_.surface->hessian().multiply(sample_in_, sample_out_);
    problem_.pull_back_samples(sample_out_, from_samples_);
    add_scaled(1, from_samples_, out);
  }

  void precondition(std::span<const Vec3> in, std::span<Vec3> out) const {
#pragma omp parallel for schedule(static)
    for (std::size_t j = 0; j < in.size(); ++j) out[j] = inverse_diagonal_[j] * in[j];
  }

 private:
  const FitProblem& problem_;
  std::vector<Mat3>& inverse_diagonal_;
  std::vector<Vec3> node_in_, node_out_, sample_in_, sample_out_, from_samples_;
};

/// Solves H d = -g approximately, or not where the caller wants an end; returns the number of iterations.
int conjugate_gradients(ReducedHessian& hessian, std::span<const Vec3> gradient, const MinimizerOptions& options,
                        std::vector<Vec3>& d) {
  const std::size_t n = gradient.size();
  std::vector<Vec3> r(n), z(n), p(n), hp(n);
  d.assign(n, Vec3::Zero());
  for (std::size_t i = 0; i < n; ++i) r[i] = -gradient[i];
  hessian.precondition(r, z);
  p = z;
  double rz = dot(r, z);
  const double stop = options.cg_tolerance * options.cg_tolerance * rz;
  int iteration = 0;
  while (iteration < options.cg_max_iterations && rz > stop && !(options.ended && options.ended())) {
    ++iteration;
    hessian.multiply(p, hp);
    const double php = dot(p, hp);
    if (!(php > 0)) break;
    add_scaled(rz / php, p, d);
    add_scaled(-rz / php, hp, r);
    hessian.precondition(r, z);
    const double next = dot(r, z);
    const double beta = next / rz;
    rz = next;
#pragma omp parallel for schedule(static)
    for (std::size_t i = 0; i < n; ++i) p[i] = z[i] + beta * p[i];
  }
  return iteration;
}

std::string describe(const char* form, double value) {
  char text[128];
  std::snprintf(text, sizeof text, form, value);
  return text;
}

/// Cells of `now` that are not in `before` (both ascending).
std::vector<Index> newly_failed(const std::vector<Index>& before, const std::vector<Index>& now) {
  std::vector<Index> result;
  std::set_difference(now.begin(), now.end(), before.begin(), before.end(), std::back_inserter(result));
  return result;
}

void cancel(MinimizerResult& result) {
  result.stop = MinimizerStop::cancelled;
  result.explanation = "stopped by the caller";
}

}  // namespace

bool has_ended(const MinimizerOptions& options, MinimizerResult& result) {
  if (!options.ended || !options.ended()) return false;
  cancel(result);
  return true;
}

bool record_step(const IterationRecord& record, const MinimizerOptions& options, MinimizerResult& result) {
  result.iterations.push_back(record);
  if (!options.progress || options.progress(record)) return true;
  cancel(result);
  return false;
}

void densify_again(FitProblem& problem, const MinimizerResult& result) {
  if (result.densified.empty()) return;
  if (result.densified_at.size() != problem.nodes.num_cols)
    throw InputError("cells were densified at a state of " + std::to_string(result.densified_at.size()) +
                     " unknowns, expected " + std::to_string(problem.nodes.num_cols));
  std::vector<Vec3> nodes(problem.nodes.num_rows());
  problem.apply_nodes(result.densified_at, nodes);
  for (const std::vector<Index>& cells : result.densified) problem.volume->densify(cells, nodes);
}

MinimizerResult minimize_newton(FitProblem& problem, std::vector<Vec3>& x, const MinimizerOptions& options) {
  constexpr double kArmijo = 1e-4;
  constexpr int kMaxHalvings = 30, kPreconditionerLife = 4, kMaxStiffenings = 5;
  constexpr double kShortStep = 0.5;
  MinimizerResult result{MinimizerStop::iteration_limit, "", {}};
  if (options.begun) result = *options.begun;
  result.stop = MinimizerStop::iteration_limit;
  densify_again(problem, result);
  const std::size_t n = x.size();
  std::vector<Vec3> y(problem.nodes.num_rows()), z(problem.samples.num_rows());
  problem.apply_nodes(x, y);
  problem.apply_samples(x, z);
  std::vector<Vec3> node_gradient(y.size()), sample_gradient(z.size()), gradient(n), from_samples(n), d, dy(y.size()),
      dz(z.size()), y_trial(y.size()), z_trial(z.size());
  std::vector<Mat3> inverse_diagonal;
  std::vector<Index> uncertified = problem.volume->uncertified(y);

  for (int iteration = static_cast<int>(result.iterations.size()); iteration < options.max_iterations; ++iteration) {
    // Here x and the result are all that passes on, so that they are enough to go on from.
    if (iteration > 0 && iteration % kPreconditionerLife == 0) {
      if (problem.surface) problem.surface->forget();
      inverse_diagonal.clear();
      uncertified = problem.volume->uncertified(y);
      if (options.keep) options.keep(x, result);
    }
    IterationRecord record;
    if (problem.surface) problem.surface->assign(z);
    std::fill(node_gradient.begin(), node_gradient.end(), Vec3::Zero());
    std::fill(sample_gradient.begin(), sample_gradient.end(), Vec3::Zero());
    const double surface = problem.surface ? problem.surface->value(z) : 0;
    const double volume = problem.volume->linearize(y, problem.lambda, node_gradient);
    const double energy = surface + problem.lambda * volume;
    if (!std::isfinite(energy)) {
      result.stop = MinimizerStop::infeasible_start;
      result.explanation = "the start has a cell that is inverted at a quadrature point";
      return result;
    }
    problem.nodes_transposed.apply(node_gradient, gradient);
    if (problem.surface) {
      problem.surface->add_gradient(z, sample_gradient);
      problem.pull_back_samples(sample_gradient, from_samples);
      add_scaled(1, from_samples, gradient);
    }

    // The diagonal changes slowly once the first steps are done.
    if (iteration < 2) inverse_diagonal.clear();
    double slope = 0, t = 0;
    for (int round = 0;; ++round) {
      ReducedHessian reduced(problem, inverse_diagonal);
      record.linear_iterations += conjugate_gradients(reduced, gradient, options, d);
      if (has_ended(options, result)) return result;
      slope = dot(gradient, d);
      if (!(slope < 0)) break;
      problem.nodes.apply(d, dy);
      t = problem.volume->max_step(y, dy);
      // Few points would have the whole step be short: better that they stay.
      if (t >= kShortStep || round == kMaxStiffenings || !problem.volume->stiffen(y, dy, kShortStep)) break;
      inverse_diagonal.clear();
    }
    if (!(slope < 0)) {
      result.stop = MinimizerStop::converged;
      result.explanation = "the gradient vanishes";
      return result;
    }
    problem.multiply_samples(d, dz);

    double trial = 0, trial_surface = 0, trial_volume = 0;
    std::vector<Index> blocking, trial_uncertified;
    bool accepted = false, drawn_back = !problem.volume->keeps_off_inversion();
    for (int halving = 0; halving < kMaxHalvings && !accepted; ++halving, t *= accepted ? 1 : 0.5) {
      if (has_ended(options, result)) return result;
      for (std::size_t i = 0; i < y.size(); ++i) y_trial[i] = y[i] + t * dy[i];
      for (std::size_t i = 0; i < z.size(); ++i) z_trial[i] = z[i] + t * dz[i];
      ++record.evaluations;
      trial_surface = problem.surface ? problem.surface->value(z_trial) : 0;
      trial_volume = problem.volume->value(y_trial);
      trial = trial_surface + problem.lambda * trial_volume;
      if (!(trial <= energy + kArmijo * t * slope)) continue;
      trial_uncertified = problem.volume->uncertified(y_trial);
      const std::vector<Index> failed = newly_failed(uncertified, trial_uncertified);
      accepted = failed.empty() && (blocking.empty() || drawn_back);
      drawn_back |= failed.empty();
      blocking.insert(blocking.end(), failed.begin(), failed.end());
    }
    if (!blocking.empty()) {
      problem.volume->densify(blocking, y);
      result.densified.push_back(std::move(blocking));
      result.densified_at = x;
    }
    if (!accepted) {
      result.stop = MinimizerStop::no_step;
      result.explanation = "no step along the search direction decreases the energy";
      return result;
    }
    add_scaled(t, d, x);
    problem.apply_nodes(x, y);
    problem.apply_samples(x, z);
    uncertified = std::move(trial_uncertified);
    record.surface_energy = trial_surface;
    record.volume_energy = trial_volume;
    record.step_length = t;
    if (!record_step(record, options, result)) return result;
    const double decrease = (energy - trial) / energy;
    result.small_steps = decrease < options.relative_decrease ? result.small_steps + 1 : 0;
    if (result.small_steps == 2) {
      result.stop = MinimizerStop::converged;
      result.explanation = describe("relative decrease of the energy %.2g in two steps running", decrease);
      return result;
    }
  }
  result.explanation = "iteration limit";
  return result;
}

}  // namespace subvol
