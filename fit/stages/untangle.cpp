// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/stages/untangle.h"

#include "subvol/base/format.h"
#include "subvol/fit/energies/regularized_barrier.h"
#include "subvol/fit/stages/fit_report.h"

#include <algorithm>
#include <cmath>

namespace subvol::internal {

namespace {

constexpr double kLeastEpsilon = 1e-4;  // relative to a determinant of 1
/// Factor on the weight of cells that are not certified after a round that has converged.
constexpr double kWeightGrowth = 1.5;
/// A round ends after so many steps, or when two steps in a row decrease the energy by a smaller share than this:
/// the next epsilon changes it anyway.
constexpr int kUntanglingRoundSteps = 5;
constexpr double kRelativeDecrease = 1e-2;
/// Relative rise of the worst determinant that counts as a gain even if no fewer cells fail.
constexpr double kLeastRise = 0.01;

/// The cells of a problem and their state between rounds.
class TangledCells {
 public:
  TangledCells(FitProblem& problem, std::size_t num_cells)
      : problem_(problem),
        energy_(dynamic_cast<RegularizedTerm&>(*problem.volume)),
        nodes_(problem.nodes.num_rows()),
        least_(num_cells),
        weights_(num_cells, 1) {}
  TangledCells(const TangledCells&) = delete;
  TangledCells& operator=(const TangledCells&) = delete;
  ~TangledCells() { energy_.set_regularization(0); }

  /// Certifies the cells of a state and measures their determinants; returns true if every cell is certified.
  bool look(std::span<const Vec3> x) {
    problem_.apply_nodes(x, nodes_);
    uncertified_ = energy_.not_certified(nodes_);
    if (uncertified_.empty()) return true;
    energy_.least_determinants(nodes_, least_);
    // Cells that are positive at all their points but still fail need more points to show where they invert.
    std::vector<Index> hidden;
    for (const Index c : uncertified_)
      if (least_[c] > 0) hidden.push_back(c);
    if (!hidden.empty()) {
      energy_.densify(hidden, nodes_);
      energy_.least_determinants(nodes_, least_);
    }
    determinant_ = *std::min_element(least_.begin(), least_.end());
    return false;
  }

  void raise_weights() {
    for (const Index c : uncertified_) weights_[c] *= kWeightGrowth;
    energy_.set_weights(weights_);
  }

  double determinant() const { return determinant_; }
  const std::vector<Index>& uncertified() const { return uncertified_; }
  void set_epsilon(double epsilon) { energy_.set_regularization(epsilon); }
  double energy(std::span<const Vec3> x) {
    problem_.apply_nodes(x, nodes_);
    return energy_.value(nodes_);
  }

 private:
  FitProblem& problem_;
  RegularizedTerm& energy_;
  std::vector<Vec3> nodes_;
  std::vector<double> least_, weights_;
  std::vector<Index> uncertified_;
  double determinant_ = 0;
};

}  // namespace

UntangleResult untangle(FitProblem& problem, std::size_t num_cells, const UntangleOptions& options,
                        const StageRunner& runner, const StageRecord& record, std::vector<Vec3>& x, FitReport& report) {
  const OptimizeTuning& tuning = options.tuning;
  TangledCells cells(problem, num_cells);
  if (cells.look(x)) return {};
  double epsilon = std::max(tuning.share_of_worst * std::abs(cells.determinant()), kLeastEpsilon);
  std::size_t fewest = cells.uncertified().size();
  double best = cells.determinant();
  int idle = 0;
  for (int round = 0; round < options.max_rounds && idle < options.patience; ++round) {
    cells.set_epsilon(epsilon);
    StageRecord stage = record;
    stage.name = record.name + formatted(", epsilon %.3g", epsilon);
    const double before = cells.energy(x);
    const Stage weights{problem.lambda, options.tangential_weight, kUntanglingRoundSteps, kRelativeDecrease};
    const bool going = runner.run(problem, weights, std::move(stage), x, report);
    const double decrease = 1 - cells.energy(x) / before;
    if (cells.look(x) || !going) return {going, cells.uncertified()};
    const bool gained = cells.uncertified().size() < fewest || cells.determinant() > best + kLeastRise * std::abs(best);
    idle = gained ? 0 : idle + 1;
    fewest = std::min(fewest, cells.uncertified().size());
    best = std::max(best, cells.determinant());
    double next = tuning.share_of_worst * std::abs(cells.determinant());
    if (decrease < tuning.converged_decrease) {
      next = std::min(next, tuning.least_fall * epsilon);
      cells.raise_weights();
    }
    epsilon = std::max(next, kLeastEpsilon);
  }
  return {true, cells.uncertified()};
}

}  // namespace subvol::internal
