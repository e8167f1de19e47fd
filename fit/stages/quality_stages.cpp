// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/stages/quality_stages.h"

#include "subvol/base/error.h"
#include "subvol/base/format.h"
#include "subvol/mesh/mesh_topology.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace subvol {

namespace {

/// The threshold of the hinge lies this far above the goal: a squared hinge is not zero where it balances the surface.
constexpr double kMargin = 0.15;
/// A coarse mesh needs no more than this below the goal: refining raises the mean, and the lift of the fine mesh the
/// least.
constexpr double kCoarseMargin = 0.05;
constexpr int kMostCoarseLiftSteps = 20, kMostFineLiftSteps = 40;

double above(double goal, double margin = kMargin) { return std::min(0.95, goal + margin); }

}  // namespace

QualitySchedule coarse_quality_schedule(double goal) {
  const auto weights = [](double hinge, double threshold) {
    return QualityWeights{.hinge = hinge, .threshold = threshold};
  };
  return {{{1, weights(50, 0.3), 12}, {10, weights(50, 0.5), 12}, {100, weights(100, 0.6), 12}},
          {100, weights(200, goal), kMostCoarseLiftSteps},
          goal - kCoarseMargin};
}

QualitySchedule smooth_quality_schedule() {
  return {{{1, {.hinge = 50, .threshold = 0.3}, 12}, {10, {.hinge = 50, .threshold = 0.4}, 10}}, {100, {}, 0}, 0.1};
}

QualitySchedule fine_quality_schedule(double goal) {
  const auto weights = [](double hinge, double threshold) {
    return QualityWeights{.hinge = hinge, .threshold = threshold};
  };
  return {{{20, weights(50, 0.6), 8}, {100, weights(100, above(goal, 0.1)), 8}},
          {100, weights(200, above(goal)), kMostFineLiftSteps},
          goal};
}

QualityStages::QualityStages(const VolumeMesh& mesh, std::span<const Vec3> lengths, SparseMap nodes, SparseMap samples,
                             std::unique_ptr<SurfaceTerm> surface, double target_length)
    : energy_(nullptr),
      problem_(std::move(nodes), std::move(samples), std::make_unique<QualityEnergy>(mesh, lengths), std::move(surface),
               1.0) {
  energy_ = static_cast<QualityEnergy*>(problem_.volume.get());
  // In units of the cells, E_S is w_s times the sum over the boundary faces of the mean squared distance / h^2:
  // K E_S = w_s n 2 L^2 / h^2 E_S for n faces of length h. So E_S + E_Q / K is minimized.
  const MeshTopology topology(mesh);
  double squares = 0;
  const auto& faces = topology.boundary_faces();
  for (const Index f : faces) {
    const Vec3& h = lengths[topology.face_cells(f)[0]];
    squares += std::pow(h.prod(), 2.0 / 3);
  }
  const double count = static_cast<double>(std::max<std::size_t>(faces.size(), 1));
  const double mean_square = faces.empty() ? 1 : squares / count;
  mean_length_ = std::sqrt(mean_square);
  lambda_one_ = mean_square / (2 * count * target_length * target_length);
}

bool QualityStages::run_stage(const QualityStage& stage, const std::string& name, double relative_decrease,
                              std::vector<Vec3>& x) {
  constexpr double kTangentialWeight = 0.02;
  energy_->set_weights(stage.weights);
  const double lambda = lambda_one_ / stage.surface;
  problem_.lambda = lambda;
  StageRecord record = record_;
  record.name = name;
  const Stage settings{lambda, kTangentialWeight, stage.steps, relative_decrease, mean_length_};
  return runner_->run(problem_, settings, std::move(record), fraction_, x, *report_);
}

/// Raises the emphasis on poor cells every two steps until none is left, and keeps the best state.
bool QualityStages::lift(const QualitySchedule& schedule, std::vector<Vec3>& x) {
  constexpr int kSteps = 2;
  constexpr double kNoEnd = 1e-9;  // two steps must not end a stage
  energy_->reset_emphasis();
  std::vector<Vec3> nodes(problem_.nodes.num_rows()), best;
  State best_state{-2, -2, 0};
  bool going = true;
  for (int done = 0;; done += kSteps) {
    problem_.apply_nodes(x, nodes);
    const std::vector<Index> between = energy_->poor_between_points(nodes, schedule.goal);
    energy_->densify(between);
    state_ = energy_->emphasize_poor(nodes, schedule.goal);
    if (state_.least_share > best_state.least_share) {
      best_state = state_;
      best = x;
    }
    if (!going || state_.below == 0 || done >= schedule.lift.steps) break;
    QualityStage stage = schedule.lift;
    stage.steps = kSteps;
    going = run_stage(stage, formatted("%s, lift %d, %zu cells below %.2f", record_.name.c_str(), done / kSteps + 1,
                                       state_.below, schedule.goal),
                      kNoEnd, x);
  }
  x = std::move(best);
  state_ = best_state;
  return going;
}

bool QualityStages::run(const QualitySchedule& schedule, const StageRunner& runner, const StageRecord& record,
                        double fraction, std::vector<Vec3>& x, FitReport& report) {
  constexpr double kLeastDecrease = 1e-3;
  runner_ = &runner;
  record_ = record;
  fraction_ = fraction;
  report_ = &report;
  for (const QualityStage& stage : schedule.stages)
    if (!run_stage(stage, formatted("%s, surface %g, threshold %.2f", record.name.c_str(), stage.surface,
                                    stage.weights.threshold),
                   kLeastDecrease, x))
      return false;
  return lift(schedule, x);
}

}  // namespace subvol
