// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/solver/levenberg_marquardt.h"

#include "subvol/fit/solver/minimizer_run.h"
#include "subvol/fit/solver/vector_math.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <numeric>
#include <utility>

namespace subvol::internal {

namespace {

/// Largest mu, relative to the diagonal of the Hessian: it stops a degree of freedom.
constexpr double kMostDamping = 1e4;
constexpr double kMostLocalDamping = 1e6;  // largest local factor, so that it can fall again within a few steps
constexpr int kMostTrials = 8;             // of a step, each with a larger mu

/// Returns mu after a trial that was not taken.
double raised(double damping, const QualityTuning& tuning) {
  return std::min(kMostDamping, tuning.damping_rise * damping);
}

/// Returns mu after a step that was taken at once.
double lowered(double damping, const QualityTuning& tuning) {
  return std::max(tuning.least_damping, tuning.damping_fall * damping);
}

/// Returns the cells whose energy rises most, as few as account for half of all rises.
std::vector<Index> most_risen(std::span<const double> before, std::span<const double> after) {
  constexpr double kExplainedRiseShare = 0.5;
  std::vector<Index> cells;
  const auto rise = [&](Index c) { return after[c] - before[c]; };
  double rest = 0;
  for (std::size_t i = 0; i < before.size(); ++i) {
    const auto c = static_cast<Index>(i);
    if (!(rise(c) > 0)) continue;
    rest += kExplainedRiseShare * rise(c);
    cells.push_back(c);
  }
  std::ranges::stable_sort(cells, std::greater{}, rise);
  std::size_t count = 0;
  while (count < cells.size() && rest > 0) rest -= rise(cells[count++]);
  cells.resize(count);
  return cells;
}

/// One minimization by the Levenberg-Marquardt method.
class LevenbergMarquardtRun : MinimizerRun {
 public:
  LevenbergMarquardtRun(FitProblem& problem, std::vector<Vec3>& x, const MinimizerOptions& options);
  MinimizerResult run();

 private:
  void damp(ReducedHessian& hessian, std::span<const Mat3> diagonal);
  /// Finds a step d_ that decreases E. Returns false if there is none, or if the caller wants to stop.
  bool find_step(IterationRecord& record);
  /// Shortens d_ at the vertices of cells that it would ruin. Returns false if cells still lose their certificate.
  bool shorten_where_harmful();
  void shorten_at(std::span<const Index> cells, double factor);
  void try_nodes();
  void evaluate_trial();
  /// Shortens d_ at the vertices of the few cells that lose more than all else gains, until E decreases. Returns false
  /// if it does not, or if the caller wants to stop.
  bool shorten_until_downhill();
  /// Raises the damping where d_ was shortened, and lowers it elsewhere.
  void damp_where_shortened();
  bool admits_step(IterationRecord& record) override;

  double damping_ = 0;
  std::vector<double> local_damping_;    // what mu is multiplied by at each degree of freedom
  std::vector<std::uint8_t> shortened_;  // not zero for the degrees of freedom at which d_ was shortened
  std::vector<double> trial_cells_;      // energy of each cell at y_trial_
};

LevenbergMarquardtRun::LevenbergMarquardtRun(FitProblem& problem, std::vector<Vec3>& x, const MinimizerOptions& options)
    : MinimizerRun(problem, x, options) {
  damping_ = damping_after(options.first_damping, result_.iterations, options.damping);
  local_damping_.assign(x.size(), 1);
  uncertified_ = problem.volume->uncertified(y_);
}

void LevenbergMarquardtRun::damp(ReducedHessian& hessian, std::span<const Mat3> diagonal) {
  // Share of the mean of the diagonal. A degree of freedom without energy must not make the matrix singular.
  constexpr double kAddedDiagonalShare = 1e-12;
  std::vector<double> added(diagonal.size());
  double mean = 0;
  for (std::size_t j = 0; j < diagonal.size(); ++j) mean += added[j] = diagonal[j].trace() / 3;
  mean /= static_cast<double>(std::max<std::size_t>(diagonal.size(), 1));
  std::vector<Mat3> damped(diagonal.begin(), diagonal.end());
  for (std::size_t j = 0; j < added.size(); ++j) {
    added[j] =
        std::min(kMostDamping, damping_ * local_damping_[j]) * 0.5 * (added[j] + mean) + kAddedDiagonalShare * mean;
    damped[j].diagonal().array() += added[j];
  }
  inverse_diagonal_ = inverse_blocks(damped);
  hessian.add_diagonal(std::move(added));
}

void LevenbergMarquardtRun::try_nodes() {
  problem_.nodes.apply(d_, dy_);
  for (std::size_t i = 0; i < y_.size(); ++i) y_trial_[i] = y_[i] + dy_[i];
}

void LevenbergMarquardtRun::shorten_at(std::span<const Index> cells, double factor) {
  std::vector<std::uint8_t> marked(d_.size(), 0);
  for (const Index node : problem_.volume->nodes_of(cells))
    for (const Index j : problem_.nodes.row_columns(node)) marked[j] = 1;
  for (std::size_t j = 0; j < d_.size(); ++j) {
    if (marked[j] == 0) continue;
    d_[j] *= factor;
    shortened_[j] = 1;
  }
}

void LevenbergMarquardtRun::damp_where_shortened() {
  const double rise = options_.damping.damping_rise, fall = options_.damping.damping_fall;
  for (std::size_t j = 0; j < local_damping_.size(); ++j) {
    double& local = local_damping_[j];
    local = shortened_[j] != 0 ? std::min(kMostLocalDamping, rise * local) : std::max(1.0, fall * local);
  }
}

bool LevenbergMarquardtRun::shorten_where_harmful() {
  // The steps of ruined cells are halved, and are 0 in the last passes. The same number of passes stops cells that lose
  // their certificate.
  constexpr int kStepHalvingPasses = 10, kStepStopPasses = 4;
  for (int pass = 0; pass < kStepHalvingPasses + kStepStopPasses; ++pass) {
    const std::vector<Index> ruined = problem_.volume->ruined(y_, y_trial_);
    if (ruined.empty()) break;
    shorten_at(ruined, pass < kStepHalvingPasses ? 0.5 : 0);
    try_nodes();
  }
  for (int pass = 0; pass < kStepStopPasses; ++pass) {
    trial_uncertified_ = problem_.volume->uncertified(y_trial_);
    const std::vector<Index> failed = newly_failed(uncertified_, trial_uncertified_);
    if (failed.empty()) return true;
    shorten_at(failed, 0);
    try_nodes();
  }
  trial_uncertified_ = problem_.volume->uncertified(y_trial_);
  return newly_failed(uncertified_, trial_uncertified_).empty();
}

void LevenbergMarquardtRun::evaluate_trial() {
  problem_.multiply_samples(d_, dz_);
  for (std::size_t i = 0; i < z_.size(); ++i) z_trial_[i] = z_[i] + dz_[i];
  trial_surface_ = problem_.surface ? problem_.surface->value(z_trial_) : 0;
  trial_cells_ = problem_.volume->cell_values(y_trial_);
  trial_volume_ = std::accumulate(trial_cells_.begin(), trial_cells_.end(), 0.0);
  trial_ = trial_surface_ + problem_.lambda * trial_volume_;
}

bool LevenbergMarquardtRun::shorten_until_downhill() {
  constexpr int kMostShortenings = 8;  // of one step at the cells whose energy rises most
  std::vector<double> cells;
  for (int pass = 0; shorten_where_harmful(); ++pass) {
    evaluate_trial();
    if (trial_ < energy_) return true;
    if (!options_.spares_most || pass == kMostShortenings || has_ended(options_, result_)) return false;
    if (cells.empty()) cells = problem_.volume->cell_values(y_);
    shorten_at(most_risen(cells, trial_cells_), 0.5);
    try_nodes();
  }
  return false;
}

bool LevenbergMarquardtRun::find_step(IterationRecord& record) {
  ReducedHessian hessian(problem_);
  const std::vector<Mat3> diagonal = hessian.diagonal();
  for (int trial = 0; trial < kMostTrials; ++trial) {
    damp(hessian, diagonal);
    record.linear_iterations += conjugate_gradients(hessian, inverse_diagonal_, linearized_.gradient(), options_, d_);
    if (has_ended(options_, result_)) return false;
    shortened_.assign(d_.size(), 0);
    try_nodes();
    double longest = 0;
    for (const Vec3& d : dy_) longest = std::max(longest, d.norm());
    if (options_.longest_move > 0 && longest > options_.longest_move) {
      for (Vec3& d : d_) d *= options_.longest_move / longest;
      try_nodes();
    }
    ++record.evaluations;
    if (shorten_until_downhill()) return true;
    if (result_.stop == MinimizerStop::cancelled) return false;
    damping_ = raised(damping_, options_.damping);
  }
  return false;
}

bool LevenbergMarquardtRun::admits_step(IterationRecord&) {
  const auto is_long = [&](const Vec3& d) { return d.norm() > options_.longest_move; };
  if (options_.longest_move > 0 && std::ranges::any_of(dy_, is_long)) return false;
  return problem_.volume->ruined(y_, y_trial_).empty();
}

MinimizerResult LevenbergMarquardtRun::run() {
  // Number of steps after which a run begins anew, so that it can be resumed there: checkpoints hold no damping.
  constexpr int kStepsBetweenStates = 8;
  for (int iteration = static_cast<int>(result_.iterations.size()); iteration < options_.max_iterations; ++iteration) {
    if (iteration > 0 && iteration % kStepsBetweenStates == 0) {
      local_damping_.assign(x_.size(), 1);
      restart();
    }
    energy_ = linearized_.linearize(problem_, y_, z_, false, is_assigned_);
    is_assigned_ = false;
    if (!std::isfinite(energy_)) return end(MinimizerStop::infeasible_start, "the energy is not finite at the start");
    if (energy_ == 0) return end(MinimizerStop::converged, "the energy vanishes");
    IterationRecord record;
    if (!find_step(record)) {
      if (result_.stop == MinimizerStop::cancelled) return std::move(result_);
      return end(MinimizerStop::no_step, "no step decreases the energy");
    }
    if (record.evaluations == 1) damping_ = lowered(damping_, options_.damping);
    damp_where_shortened();
    if (!take_accelerated_step(1, record)) take_step(1, record);
    if (is_done(record)) return std::move(result_);
  }
  return end(MinimizerStop::iteration_limit, "iteration limit");
}

}  // namespace

MinimizerResult minimize_levenberg_marquardt(FitProblem& problem, std::vector<Vec3>& x,
                                             const MinimizerOptions& options) {
  return LevenbergMarquardtRun(problem, x, options).run();
}

double damping_after(double first, std::span<const IterationRecord> steps, const QualityTuning& tuning) {
  double damping = first;
  for (const IterationRecord& step : steps) {
    for (int trial = 1; trial < step.evaluations; ++trial) damping = raised(damping, tuning);
    if (step.evaluations == 1) damping = lowered(damping, tuning);
  }
  return damping;
}

}  // namespace subvol::internal
