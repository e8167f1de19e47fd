// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/stages/quality_stages.h"

#include "subvol/base/format.h"
#include "subvol/fit/solver/levenberg_marquardt.h"
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

/// A distance that is too large by a tenth weighs as much as cells that miss the goal by a fifth: distances end at their
/// bar, quality as high as possible.
constexpr double kExcessWeight = 2;

/// Width of the strip of surface that counts as much as a crease, in edges.
constexpr double kCreaseEdges = 5;

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

QualitySchedule single_quality_schedule(double goal) {
  QualitySchedule schedule = coarse_quality_schedule(goal);
  const QualitySchedule fine = fine_quality_schedule(goal);
  schedule.lift = fine.lift;
  schedule.goal = fine.goal;
  return schedule;
}

QualityStages::QualityStages(const VolumeMesh& mesh, std::span<const Vec3> lengths, const SparseMap& nodes,
                             std::vector<Vec3> fixed, const QualityBoundary& boundary, const TargetSurface& target,
                             const std::function<CreaseEnergy(double width)>& creases) {
  // In units of the cells, E_S is w_s times the sum over the boundary faces of the mean squared distance / h^2:
  // K E_S = w_s n 2 L^2 / h^2 E_S for n faces of length h. So E_S + E_Q / K is minimized. Faces of other lengths have
  // other areas, which the factors make up for.
  const MeshTopology topology(mesh);
  const auto square = [&](Index face) { return std::pow(lengths[topology.face_cells(face)[0]].prod(), 2.0 / 3); };
  double squares = 0;
  for (const Index f : topology.boundary_faces()) squares += square(f);
  for (const Index f : boundary.interfaces) squares += square(f);
  const double count = static_cast<double>(
      std::max<std::size_t>(topology.boundary_faces().size() + boundary.interfaces.size(), 1));
  const double mean_square = squares / count;
  mean_length_ = std::sqrt(mean_square);
  lambda_one_ = mean_square / (2 * count * target.length() * target.length());
  auto volume = std::make_unique<QualityEnergy>(mesh, lengths);
  energy_ = volume.get();
  std::unique_ptr<ClosestPointEnergy> surface;
  if (boundary.samples.num_rows() > 0) {
    surface = std::make_unique<ClosestPointEnergy>(target, boundary.triangles, boundary.samples.num_rows(),
                                                   kQualityTangentialWeight, 1, SurfacePull::straight_both_ways);
    for (const Index f : boundary.triangle_faces) factors_.push_back(std::pow(mean_square / square(f), 2));
    surface->weigh(factors_);
    if (!boundary.group_of_face.empty()) {
      std::vector<Index> groups;
      for (const Index f : boundary.triangle_faces) groups.push_back(boundary.group_of_face[f]);
      surface->set_groups(std::move(groups), boundary.group_of_triangle);
    }
    surface_ = surface.get();
    if (creases) {
      surface->discount_disagreeing();
      surface->add_creases(creases(kCreaseEdges * mean_length_));
    }
  }
  SparseMap samples = surface ? boundary.samples : SparseMap{nodes.num_cols, {0}, {}, {}};
  problem_ = std::make_unique<FitProblem>(nodes, std::move(samples), std::move(volume), std::move(surface), 1.0);
  problem_->fixed_samples = boundary.fixed;
  problem_->fixed_nodes = std::move(fixed);
}

bool QualityStages::run_stage(const QualityStage& stage, const std::string& name, double relative_decrease,
                              std::vector<Vec3>& x) {
  if (before_stage) before_stage();
  energy_->set_weights(stage.weights);
  const double lambda = lambda_one_ / stage.surface;
  problem_->lambda = lambda;
  StageRecord record = record_;
  record.name = name;
  const Stage settings{lambda, kQualityTangentialWeight, stage.steps, relative_decrease, mean_length_, damping_};
  const bool going = runner_->run(*problem_, settings, std::move(record), fraction_, x, *report_);
  damping_ = damping_after(damping_, report_->stages.back().iterations);
  return going;
}

/// Raises the emphasis of sample triangles that are too far from the target. Returns the largest distance.
double QualityStages::emphasize_far(double most_distance, std::span<const Vec3> x) {
  constexpr double kMargin = 0.5, kRaise = 3, kFallBack = 0.97, kMost = 1000;
  std::vector<Vec3> samples(problem_->samples.num_rows());
  problem_->apply_samples(x, samples);
  surface_->forget();
  surface_->assign(samples);
  const std::vector<double> distances = surface_->triangle_distances_with_corners();
  std::vector<double> factors = factors_;
  double largest = 0;
  for (std::size_t t = 0; t < distances.size(); ++t) {
    double& emphasis = far_emphasis_[t];
    emphasis = distances[t] > kMargin * most_distance ? std::min(kMost, kRaise * emphasis)
                                                      : std::max(1.0, kFallBack * emphasis);
    factors[t] *= emphasis;
    largest = std::max(largest, distances[t]);
  }
  surface_->weigh(std::move(factors));
  return largest;
}

/// Judges a state, and raises the emphasis on what is poor or too far there.
QualityStages::State QualityStages::inspect(const QualitySchedule& schedule, std::span<const Vec3> x) {
  std::vector<Vec3> nodes(problem_->nodes.num_rows());
  problem_->apply_nodes(x, nodes);
  energy_->densify(energy_->poor_between_points(nodes, schedule.goal));
  State state{energy_->emphasize_poor(nodes, schedule.goal)};
  const bool minds_distance = surface_ && schedule.most_distance > 0;
  if (minds_distance) state.distance = emphasize_far(schedule.most_distance, x);
  const double excess = minds_distance ? std::max(0.0, state.distance / schedule.most_distance - 1) : 0;
  state.merit = state.cells.least_share - kExcessWeight * excess;
  return state;
}

/// Raises the emphasis on poor cells and far places every two steps until none is left, and keeps the best state.
bool QualityStages::lift(const QualitySchedule& schedule, std::vector<Vec3>& x) {
  constexpr int kSteps = 2, kPatience = 8;
  constexpr double kNoEnd = 1e-9;  // two steps must not end a stage
  energy_->reset_emphasis();
  far_emphasis_.assign(factors_.size(), 1);
  std::vector<Vec3> best;
  state_ = {};
  bool going = true;
  int since_best = 0;
  for (int done = 0;; done += kSteps) {
    const State now = inspect(schedule, x);
    if (now.merit > state_.merit) {
      state_ = now;
      best = x;
      since_best = 0;
    }
    if (!going || now.merit >= 1 || ++since_best > kPatience || done >= schedule.lift.steps) break;
    QualityStage stage = schedule.lift;
    stage.steps = kSteps;
    going = run_stage(stage, formatted("%s, lift %d, %zu cells below %.2f", record_.name.c_str(), done / kSteps + 1,
                                       now.cells.below, schedule.goal),
                      kNoEnd, x);
  }
  if (surface_) surface_->weigh(factors_);
  x = std::move(best);
  return going;
}

bool QualityStages::run(const QualitySchedule& schedule, const StageRunner& runner, const StageRecord& record,
                        double fraction, std::vector<Vec3>& x, FitReport& report) {
  constexpr double kLeastDecrease = 1e-3;
  runner_ = &runner;
  record_ = record;
  fraction_ = fraction;
  report_ = &report;
  damping_ = kFirstDamping;
  energy_->reset_emphasis();
  for (const QualityStage& stage : schedule.stages)
    if (!run_stage(stage, formatted("%s, surface %g, threshold %.2f", record.name.c_str(), stage.surface,
                                    stage.weights.threshold),
                   kLeastDecrease, x))
      return false;
  return lift(schedule, x);
}

}  // namespace subvol
