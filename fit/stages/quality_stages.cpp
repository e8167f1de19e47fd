// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/stages/quality_stages.h"

#include "subvol/base/format.h"
#include "subvol/base/sort_unique.h"
#include "subvol/fit/solver/levenberg_marquardt.h"
#include "subvol/mesh/mesh_topology.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <limits>
#include <utility>

namespace subvol::internal {

namespace {

/// Rings of cells around poor ones that move with them, in one pass over all patches after the other; and the shares of
/// the goal below which cells are lifted: the first for which patches are small (`QualityTuning::most_patch_share`).
constexpr std::array<int, 3> kPatchRings{1, 3, 2};
constexpr std::array<double, 4> kPatchShares{1, 0.85, 0.6, 0.3};

/// Exponent of the norm of all costs of a state (`LiftMerit`).
constexpr double kCostExponent = 4;

double above(double goal, double margin) { return std::min(0.95, goal + margin); }

}  // namespace

double LiftMerit::cost_of_cell(double share) const {
  constexpr double kPoorShareOfGoal = 0.8;  // share of the goal below which a cell costs more
  return 1 - share + poor * std::max(0.0, kPoorShareOfGoal - share);
}

double QualitySchedule::expected_steps() const {
  constexpr double kLift = 5;  // most of the lift is done on patches
  double steps = lift.steps > 0 ? kLift : 0;
  for (const QualityStage& stage : stages) steps += stage.steps;
  return steps;
}

void QualitySchedule::give_surface_more_weight(double factor) {
  for (QualityStage& stage : stages) stage.surface *= factor;
  lift.surface *= factor;
}

QualitySchedule coarse_quality_schedule(double goal, const QualityTuning& tuning) {
  const auto weights = [](double hinge, double threshold) {
    return QualityWeights{.hinge = hinge, .threshold = threshold};
  };
  return {{{1, weights(50, 0.3), 6}, {10, weights(50, 0.5), 5}, {100, weights(100, 0.6), 6}},
          {100, weights(200, goal), tuning.most_coarse_lift_steps},
          goal - tuning.coarse_margin};
}

QualitySchedule smooth_quality_schedule() {
  return {{{1, {.hinge = 50, .threshold = 0.3}, 6}, {10, {.hinge = 50, .threshold = 0.4}, 4}}, {100, {}, 0}, 0.1};
}

QualitySchedule fine_quality_schedule(double goal, const QualityTuning& tuning) {
  const auto weights = [](double hinge, double threshold) {
    return QualityWeights{.hinge = hinge, .threshold = threshold};
  };
  return {{{20, weights(50, 0.6), 4}, {100, weights(100, above(goal, 0.1)), 5}},
          {100, weights(200, above(goal, tuning.hinge_margin)), tuning.most_fine_lift_steps},
          goal};
}

QualitySchedule late_quality_schedule(double goal, const QualityTuning& tuning) {
  // Of joint129 at level 2, the worst cell rises from 0.08 to 0.60 with these weights while no distance rises by more
  // than 5 %; with those of the fine schedule, the mean distance of the limit surface rises by a third.
  constexpr double kSlightMargin = 0.03, kSlightWeightFactor = 0.02;
  QualityWeights weights{.hinge = 200, .threshold = above(goal, kSlightMargin)};
  weights.cosine *= kSlightWeightFactor;
  weights.twist *= kSlightWeightFactor;
  QualitySchedule schedule{{}, {100, weights, tuning.most_fine_lift_steps}, goal};
  schedule.far_margin = tuning.late_far_margin;
  return schedule;
}

QualitySchedule single_quality_schedule(double goal, const QualityTuning& tuning) {
  QualitySchedule schedule = coarse_quality_schedule(goal, tuning);
  const QualitySchedule fine = fine_quality_schedule(goal, tuning);
  schedule.lift = fine.lift;
  schedule.goal = fine.goal;
  return schedule;
}

QualityStages::QualityStages(const VolumeMesh& mesh, std::span<const Vec3> lengths, const SparseMap& nodes,
                             std::vector<Vec3> fixed, const QualityBoundary& boundary, const TargetSurface& target,
                             const std::function<CreaseEnergy(double width)>& creases, const QualityTuning& tuning)
    : tuning_(tuning) {
  // In units of the cells, E_S is w_s times the sum over the boundary faces of the mean squared distance / h^2:
  // K E_S = w_s n 2 L^2 / h^2 E_S for n faces of length h. So E_S + E_Q / K is minimized. Faces of other lengths have
  // other areas, which the factors make up for.
  mesh_ = &mesh;
  const MeshTopology topology(mesh);
  const auto square = [&](Index face) { return std::pow(lengths[topology.face_cells(face)[0]].prod(), 2.0 / 3); };
  double squares = 0;
  for (const Index f : topology.boundary_faces()) squares += square(f);
  for (const Index f : boundary.interfaces) squares += square(f);
  const double count =
      static_cast<double>(std::max<std::size_t>(topology.boundary_faces().size() + boundary.interfaces.size(), 1));
  const double mean_square = squares / count;
  mean_length_ = std::sqrt(mean_square);
  lambda_one_ = mean_square / (2 * count * target.length() * target.length());
  auto volume = std::make_unique<QualityEnergy>(mesh, lengths, tuning);
  energy_ = volume.get();
  std::unique_ptr<ClosestPointEnergy> surface;
  if (boundary.samples.num_rows() > 0) {
    surface = std::make_unique<ClosestPointEnergy>(target, boundary.triangles, boundary.samples.num_rows(),
                                                   tuning_.tangential_weight, 1, SurfacePull::straight_both_ways);
    for (const Index f : boundary.triangle_faces) {
      factors_.push_back(std::pow(mean_square / square(f), 2));
      triangle_cells_.push_back(topology.face_cells(f)[0]);
    }
    surface->weigh(factors_);
    if (!boundary.group_of_face.empty()) {
      std::vector<Index> groups;
      for (const Index f : boundary.triangle_faces) groups.push_back(boundary.group_of_face[f]);
      surface->set_groups(std::move(groups), boundary.group_of_triangle);
    }
    surface_ = surface.get();
    if (creases) {
      surface->discount_disagreeing();
      surface->add_creases(creases(tuning.crease_edges * mean_length_));
    }
  }
  SparseMap samples = surface ? boundary.samples : SparseMap{nodes.num_cols, {0}, {}, {}};
  problem_ = std::make_unique<FitProblem>(nodes, std::move(samples), std::move(volume), std::move(surface), 1.0);
  problem_->fixed_samples = boundary.fixed;
  problem_->fixed_nodes = std::move(fixed);
}

QualityStages::QualityStages(const QualityStages& whole, const QualityPatch& patch, std::span<const Vec3> x)
    : patch_mesh_(std::make_unique<VolumeMesh>(internal::patch_mesh(*whole.mesh_, patch.cells))),
      mesh_(patch_mesh_.get()),
      tuning_(whole.tuning_),
      mean_length_(whole.mean_length_),
      lambda_one_(whole.lambda_one_),
      step_work_(static_cast<double>(patch.cells.size()) / static_cast<double>(whole.mesh_->num_cells())) {
  const FitProblem& problem = *whole.problem_;
  auto volume = std::make_unique<QualityEnergy>(*whole.energy_, *mesh_, patch.cells);
  energy_ = volume.get();

  // Returns what is fixed in some rows: the part of the degrees of freedom that do not move with the patch. It looks at
  // these rows alone, because a large mesh has many patches.
  const auto fixed_part = [&](const SparseMap& map, std::span<const Vec3> fixed, std::span<const Index> rows) {
    std::vector<Vec3> part;
    for (const Index row : rows) {
      const auto columns = map.row_columns(row);
      const auto values = map.row_values(row);
      Vec3 sum = Vec3::Zero();
      for (std::size_t k = 0; k < columns.size(); ++k)
        if (!std::ranges::binary_search(patch.unknowns, columns[k])) sum += values[k] * x[columns[k]];
      part.push_back(fixed.empty() ? sum : Vec3(sum + fixed[row]));
    }
    return part;
  };

  std::vector<Index> rows;  // samples of the patch: those of its triangles, and all on creases that move
  std::unique_ptr<ClosestPointEnergy> surface;
  SparseMap samples{patch.unknowns.size(), {0}, {}, {}};
  if (whole.surface_ && !patch.triangles.empty()) {
    std::vector<std::uint8_t> is_used(problem.samples.num_rows(), 0);
    for (const Index t : patch.triangles)
      for (const Index sample : whole.surface_->triangles()[t]) is_used[sample] = 1;
    if (whole.surface_->creases())
      whole.surface_->creases()->mark_moving_curves(
          [&](Index sample) {
            return std::ranges::any_of(problem.samples.row_columns(sample),
                                       [&](Index j) { return std::ranges::binary_search(patch.unknowns, j); });
          },
          is_used);
    std::vector<Index> numbers(is_used.size(), kNoIndex);
    for (std::size_t i = 0; i < is_used.size(); ++i) {
      if (!is_used[i]) continue;
      numbers[i] = static_cast<Index>(rows.size());
      rows.push_back(static_cast<Index>(i));
    }
    samples = select(problem.samples, rows, patch.unknowns);
    std::vector<std::uint8_t> is_free(rows.size());
    for (std::size_t i = 0; i < rows.size(); ++i) is_free[i] = samples.row_size(i) > 0;
    surface = std::make_unique<ClosestPointEnergy>(*whole.surface_, patch.triangles, numbers, is_free);
    surface_ = surface.get();
    for (const Index t : patch.triangles) factors_.push_back(whole.factors_[t]);
    surface_->weigh(factors_);
  }
  problem_ = std::make_unique<FitProblem>(select(problem.nodes, patch.vertices, patch.unknowns), std::move(samples),
                                          std::move(volume), std::move(surface), problem.lambda);
  problem_->fixed_nodes = fixed_part(problem.nodes, problem.fixed_nodes, patch.vertices);
  problem_->fixed_samples = fixed_part(problem.samples, problem.fixed_samples, rows);
}

bool QualityStages::run_stage(const QualityStage& stage, const std::string& name, bool is_lift, std::vector<Vec3>& x) {
  constexpr double kLeastDecrease = 3e-3, kNoEnd = 1e-9;  // the few steps of a lift must not end by themselves
  if (before_stage) before_stage();
  energy_->set_weights(stage.weights);
  const double lambda = lambda_one_ / stage.surface;
  problem_->lambda = lambda;
  StageRecord record = record_;
  record.name = name;
  Stage settings{lambda,  tuning_.tangential_weight, stage.steps, is_lift ? kNoEnd : kLeastDecrease, mean_length_,
                 damping_};
  settings.accelerates = true;
  settings.spares_most = !is_lift;
  const bool going = runner_->run(*problem_, settings, std::move(record), x, *report_, step_work_);
  damping_ = damping_after(damping_, report_->stages.back().iterations, tuning_);
  if (after_stage) after_stage(name, x);
  return going;
}

/// Raises the emphasis of sample triangles that are too far from the target, and notes the cells at
/// triangles that are farther than what is aimed at. Returns the sum of c_t^4 (`LiftMerit`).
double QualityStages::emphasize_far(const QualitySchedule& schedule, std::span<const Vec3> x, State& state) {
  // Factors on the emphasis of a triangle that is too far, or near enough, and the largest emphasis.
  constexpr double kFarEmphasisRise = 3, kFarEmphasisFall = 0.97, kMostFarEmphasis = 1000;
  std::vector<Vec3> samples(problem_->samples.num_rows());
  problem_->apply_samples(x, samples);
  if (!patch_mesh_) surface_->forget();  // the fit may be resumed from here, but not within a patch
  surface_->assign(samples);
  std::vector<double> shares = surface_->triangle_distances_with_corners();
  for (double& share : shares) share /= schedule.most_distance;
  std::vector<double> factors = factors_;
  double costs = 0;
  for (std::size_t t = 0; t < shares.size(); ++t) {
    double& emphasis = far_emphasis_[t];
    emphasis = shares[t] > schedule.far_margin ? std::min(kMostFarEmphasis, kFarEmphasisRise * emphasis)
                                               : std::max(1.0, kFarEmphasisFall * emphasis);
    factors[t] *= emphasis;
    costs += std::pow(schedule.merit.cost_of_place(shares[t] - 1), kCostExponent);
    if (shares[t] > 1 && !triangle_cells_.empty()) state.far_cells.push_back(triangle_cells_[t]);
  }
  surface_->weigh(std::move(factors));
  sort_unique(state.far_cells);
  return costs;
}

/// Judges a state, and raises the emphasis on what is poor or too far there.
QualityStages::State QualityStages::inspect(const QualitySchedule& schedule, std::span<const Vec3> x) {
  std::vector<Vec3> nodes(problem_->nodes.num_rows());
  problem_->apply_nodes(x, nodes);
  energy_->densify(energy_->poor_between_points(nodes, schedule.goal));
  State state{energy_->emphasize_poor(nodes, schedule.goal)};
  double costs = surface_ && schedule.most_distance > 0 ? emphasize_far(schedule, x, state) : 0;
  for (const double share : state.cells.shares) costs += std::pow(schedule.merit.cost_of_cell(share), kCostExponent);
  state.merit = 1 - std::pow(costs, 1 / kCostExponent);
  return state;
}

/// Returns the patches around some cells; none if they are most of the mesh.
std::vector<QualityPatch> QualityStages::patches_around(std::span<const Index> centers, int rings) const {
  const auto most = static_cast<std::size_t>(tuning_.most_patch_share * static_cast<double>(mesh_->num_cells()));
  return quality_patches(*mesh_, *problem_, surface_ ? surface_->triangles() : std::span<const std::array<Index, 3>>{},
                         centers, rings, most);
}

/// Returns the patches around all cells that reach less than this share of the goal, or are too far from the target;
/// none if they are most of the mesh.
std::vector<QualityPatch> QualityStages::patches_of(const State& state, double share, int rings) const {
  std::vector<Index> poor, centers;
  for (std::size_t i = 0; i < state.cells.poor.size(); ++i)
    if (state.cells.shares[i] < share) poor.push_back(state.cells.poor[i]);
  std::set_union(poor.begin(), poor.end(), state.far_cells.begin(), state.far_cells.end(), std::back_inserter(centers));
  return patches_around(centers, rings);
}

/// Runs a schedule on patches, one after the other. Returns false if the fit must end.
bool QualityStages::run_patches(const QualitySchedule& of_patch, std::span<const QualityPatch> patches,
                                const std::string& name, std::vector<Vec3>& x) {
  const StageRunner quiet = runner_->without_log();  // this can be done again from x, which the log has
  const double begin = runner_->seconds();
  if (before_stage) before_stage();
  if (surface_) {  // the patches' shares of the target are what corresponds to them here
    std::vector<Vec3> samples(problem_->samples.num_rows());
    problem_->apply_samples(x, samples);
    surface_->weigh(factors_);
    surface_->forget();
    surface_->assign(samples);
  }
  std::size_t reached = 0, unknowns = 0;
  bool going = true;
  for (const QualityPatch& patch : patches) {
    QualityStages part(*this, patch, x);
    std::vector<Vec3> own;
    for (const Index j : patch.unknowns) own.push_back(x[j]);
    FitReport report;
    StageRecord record = record_;
    record.name += formatted(", patch of %zu cells", patch.cells.size());
    going = part.run(of_patch, quiet, record, own, report);
    for (std::size_t i = 0; i < own.size(); ++i) x[patch.unknowns[i]] = own[i];
    reached += part.state().merit >= 1;
    unknowns += patch.unknowns.size();
    if (going) continue;
    report_->stop_reason = report.stop_reason;
    report_->explanation = report.explanation;
    break;
  }
  StageRecord record = record_;
  record.name = formatted("%s, %s of %zu patches", record_.name.c_str(), name.c_str(), patches.size());
  record.lambda = lambda_one_ / of_patch.lift.surface;
  record.tangential_weight = tuning_.tangential_weight;
  record.unknowns = unknowns;
  record.raises_quality = true;
  record.stop = formatted("%zu of %zu patches reached their goal", reached, patches.size());
  record.seconds = runner_->seconds() - begin;
  if (after_stage) after_stage(record.name, x);
  report_->stages.push_back(std::move(record));
  return going;
}

bool QualityStages::relax(std::span<const Index> centers, int rings, const QualityStage& stage,
                          const StageRunner& runner, const StageRecord& record, std::vector<Vec3>& x,
                          FitReport& report) {
  constexpr double kNoGoal = 0.1;  // scaled Jacobian; of no effect, since there is no lift
  runner_ = &runner;
  record_ = record;
  report_ = &report;
  energy_->reset_emphasis();
  const std::vector<QualityPatch> patches = patches_around(centers, rings);
  return patches.empty() || run_patches({{stage}, {stage.surface, stage.weights, 0}, kNoGoal}, patches,
                                        formatted("relaxation at surface %g", stage.surface), x);
}

/// Raises the emphasis on poor cells and far places every two steps while that helps, lifts patches around poor cells
/// then, and keeps the best state.
bool QualityStages::lift(const QualitySchedule& schedule, std::vector<Vec3>& x) {
  const bool is_patch = patch_mesh_ != nullptr;
  // A degree of freedom of a cage moves several vertices. Patches around its worst cells alone have too few of them:
  // joint129 at level 2 rises to 0.21 by such patches, but to 0.65 if the whole mesh is lifted as long as that helps.
  const bool is_cage = problem_->nodes.num_nonzeros() > 2 * problem_->nodes.num_cols;
  const bool is_whole_cage = is_cage && !schedule.lifts_worst_of_cage;
  energy_->reset_emphasis();
  far_emphasis_.assign(factors_.size(), 1);
  std::vector<Vec3> best;
  state_ = {};
  bool going = true;
  int since_best = 0;
  std::size_t pass = 0, poor_before = std::numeric_limits<std::size_t>::max();
  const auto next_patches = [&](const State& now) {
    std::vector<QualityPatch> patches;
    if (is_patch) return patches;
    const std::size_t poor = now.cells.poor.size(), before = std::exchange(poor_before, poor);
    const bool gains = static_cast<double>(poor) < tuning_.most_poor_share_left * static_cast<double>(before);
    for (; patches.empty() && pass < kPatchRings.size(); ++pass)
      for (std::size_t i = 0; patches.empty() && i < kPatchShares.size(); ++i) {
        if (i > 0 && (is_whole_cage || (pass == 0 && gains))) return patches;
        patches = patches_of(now, kPatchShares[i], kPatchRings[pass]);
      }
    return patches;
  };
  for (int done = 0;; done += tuning_.lift_round_steps) {
    State now = inspect(schedule, x);
    if (now.merit > state_.merit) {
      state_ = now;
      best = x;
      since_best = 0;
    }
    if (!going || now.merit >= 1 || ++since_best > tuning_.lift_patience || done >= schedule.lift.steps) break;
    if (const std::vector<QualityPatch> patches = next_patches(now); !patches.empty()) {
      QualitySchedule of_patch = schedule;
      of_patch.stages.clear();
      of_patch.far_margin = tuning_.late_far_margin;
      going = run_patches(of_patch, patches, "lift", x);
      continue;
    }
    if (pass > 0) break;
    QualityStage stage = schedule.lift;
    stage.steps = tuning_.lift_round_steps;
    going = run_stage(stage,
                      formatted("%s, lift %d, %zu cells below %.2f", record_.name.c_str(),
                                done / tuning_.lift_round_steps + 1, now.cells.poor.size(), schedule.goal),
                      true, x);
  }
  if (surface_) surface_->weigh(factors_);
  x = std::move(best);
  return going;
}

bool QualityStages::run(const QualitySchedule& schedule, const StageRunner& runner, const StageRecord& record,
                        std::vector<Vec3>& x, FitReport& report) {
  runner_ = &runner;
  record_ = record;
  report_ = &report;
  damping_ = tuning_.first_damping;
  energy_->reset_emphasis();
  for (const QualityStage& stage : schedule.stages)
    if (!run_stage(
            stage,
            formatted("%s, surface %g, threshold %.2f", record.name.c_str(), stage.surface, stage.weights.threshold),
            false, x))
      return false;
  return lift(schedule, x);
}

}  // namespace subvol::internal
