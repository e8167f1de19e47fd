// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/high_order_fit.h"

#include "subvol/base/error.h"
#include "subvol/base/format.h"
#include "subvol/fit/automatic_fit.h"
#include "subvol/fit/elements/ideal_boxes.h"
#include "subvol/fit/energies/make_surface_term.h"
#include "subvol/fit/fits/cell_lift.h"
#include "subvol/fit/fits/order_indicator.h"
#include "subvol/fit/geometry/self_intersection.h"
#include "subvol/fit/high_order_driver.h"
#include "subvol/fit/target/fit_target.h"
#include "subvol/fit/target/region_matching.h"
#include "subvol/mesh/interfaces.h"

#include <algorithm>
#include <cmath>
#include <new>
#include <span>
#include <stdexcept>
#include <tuple>
#include <utility>

namespace subvol {

using namespace internal;

namespace {

/// At first, a place at so many times the mean distance counts twice.
constexpr double kFirstFarLength = 8;
/// Mean distances below this, in percent of the diagonal, and largest ones below `CurvedTuning::near_percent` count
/// alike: a quarter of the mean that automatic fits aim at.
constexpr double kNearMeanPercent = 0.005;
/// Share of this distance from which on the surroundings of a place move.
constexpr double kStartOfFar = 0.5;
/// When states are compared, scaled Jacobians above this, or above the quality aimed at if that is higher, count alike.
constexpr double kFairScaledJacobian = 0.5;

/// The high-order fit: its sequence of orders, and the improvement of the worst places.
class HighOrderFit : HighOrderDriver {
 public:
  HighOrderFit(FitTarget target, const VolumeMesh& template_mesh, const HighOrderFitOptions& options)
      : HighOrderDriver(std::move(target), template_mesh, options) {}
  HighOrderFitResult run();
  /// start: curved cells on the template's vertices, in the target's unit.
  HighOrderFitResult run_from(const HighOrderMesh& start);

 private:
  void keep_curved_interfaces();
  template <class Work>
  HighOrderFitResult concluded(const Work& work);
  /// Where an attempt at the first orders has led.
  struct Arrival {
    bool folded;
    double mean, distortion, energy;
    HighOrderMesh mesh;
    std::vector<Vec3> ideal_boxes;
    std::vector<int> points;
    Approach approach;
    std::vector<FitState> states;
    std::vector<FitSnapshot> starts;
    int number;                            ///< number of the attempt
    std::size_t stages_begin, stages_end;  ///< in the report
  };
  void begin_try(const HighOrderTry& attempt);
  std::optional<bool> try_first_orders(const HighOrderTry& attempt, int last);
  Arrival arrival(bool folded, std::size_t stages_begin);
  void return_to(Arrival&& best, int last, std::size_t stages_before);
  bool run_order(Approach approach, int order);
  bool run_first_orders(int last);
  bool run_higher_orders();
  bool raise_where_it_pays();
  bool run_adaptive_orders();
  bool finish();
  void leave_folds();
  bool lower_lambda(std::size_t pairs);
  bool improve_worst_places();
  bool is_better(const Outcome& next) const;
  Again run_again(std::span<const Index> cells, double& setting, double value, int steps);
  Again draw_in_far_places();
  Again lift_worst_places();
  Again lift_by(double& setting, const LiftValues& values);

  Approach approach_ = Approach::direct;
  Outcome outcome_{};                    ///< of the kept state, while the worst places are improved
  double most_mean_ = 0, most_max_ = 0;  ///< largest distances that this improvement may cause
};

void HighOrderFit::begin_try(const HighOrderTry& attempt) {
  ++try_;
  approach_ = attempt.approach;
  states_.clear();
  starts_.clear();
  mesh_ = HighOrderMesh(mesh_.space.with_orders(EntityOrders::uniform(mesh_.space.topology(), 1)), template_);
  ideal_boxes_ = ideal_boxes(template_, template_.positions, target_.surface.volume(), attempt.own_box_share);
}

bool HighOrderFit::run_order(Approach approach, int order) {
  const EntityOrders orders = EntityOrders::uniform(mesh_.space.topology(), order);
  if (!has_room(orders)) return false;
  if (order > schedule_.last_common_order()) take_own_boxes();
  set_orders(orders);
  for (const Stage& stage : schedule_.stages(approach, order, options_.order))
    if (!run_next_stage(stage)) return false;
  return true;
}

/// Runs the orders up to `last` with one attempt. Returns true if the surface is folded then, which is not examined if
/// there are no other attempts; nothing if the fit must end.
std::optional<bool> HighOrderFit::try_first_orders(const HighOrderTry& attempt, int last) {
  begin_try(attempt);
  for (int order = 1; order <= last; order = order == last ? last + 1 : std::min(2 * order, last))
    if (!run_order(attempt.approach, order)) return {};
  return schedule_.tries.size() == 1 ? false : is_folded();
}

/// Describes the present state, to which the present attempt has led by the stages from `stages_begin` on.
HighOrderFit::Arrival HighOrderFit::arrival(bool folded, std::size_t stages_begin) {
  const auto& steps = report_.stages.back().iterations;
  const double distortion = steps.empty() ? 0 : steps.back().volume_energy;
  const double energy = steps.empty() ? 0 : steps.back().surface_energy + lambda_ * distortion;
  return {folded,    measured_mean(), distortion, energy, mesh_,        ideal_boxes_,         points_,
          approach_, states_,         starts_,    try_,   stages_begin, report_.stages.size()};
}

/// Makes an arrival the present state, and leaves the stages of other attempts out of the report, which had
/// `stages_before` stages before the first one. Allocates nothing.
/// last: the order that the arrival has.
void HighOrderFit::return_to(Arrival&& best, int last, std::size_t stages_before) {
  mesh_ = std::move(best.mesh);
  ideal_boxes_ = std::move(best.ideal_boxes);
  points_ = std::move(best.points);
  approach_ = best.approach;
  states_ = std::move(best.states);
  starts_ = std::move(best.starts);
  try_ = best.number;
  order_ = last;
  mean_.reset();
  report_.undo_stages(stages_before, best.stages_begin);
  report_.undo_stages(best.stages_end, report_.stages.size());
}

/// Runs the orders up to `last` with the first attempt that gets near the target without folding its surface, or else
/// with the best attempt: unfolded before folded, then by the least energy.
bool HighOrderFit::run_first_orders(int last) {
  std::optional<Arrival> best;
  const std::size_t stages_before = report_.stages.size();
  for (const HighOrderTry& attempt : schedule_.tries) {
    const std::size_t stages_begin = report_.stages.size();
    std::optional<bool> folded;
    try {
      folded = try_first_orders(attempt, last);
    } catch (const std::bad_alloc&) {
      if (best) return_to(*std::move(best), last, stages_before);
      throw;
    }
    if (!folded) {
      if (best) return_to(*std::move(best), last, stages_before);
      return false;
    }
    if (schedule_.tries.size() == 1) return true;
    Arrival next = arrival(*folded, stages_begin);
    const bool better = !best || std::tuple(next.folded, next.energy) < std::tuple(best->folded, best->energy);
    if (better) best = std::move(next);
    // Cells that are distorted and still far from the target: their resolution is not the cause.
    const bool fair = last < kTellingOrder || best->mean <= tuning().fair_distance_percent ||
                      best->distortion <= tuning().fair_distortion;
    if (!best->folded && fair) break;
  }
  return_to(*std::move(best), last, stages_before);
  set_orders(EntityOrders(mesh_.space.orders()));
  return true;
}

bool HighOrderFit::run_higher_orders() {
  stays_dense_ = true;
  while (order_ < options_.order)
    if (!run_order(approach_, std::min(2 * order_, options_.order))) return false;
  return true;
}

/// Raises the orders of the entities that gain most. Returns false if the gain is too small or memory does not suffice.
bool HighOrderFit::raise_where_it_pays() {
  const EntityOrders next = next_orders(mesh_.space.orders(), options_.order);
  if (!has_room(next)) return false;
  const HighOrderMesh raised = mesh_.with_orders(next);
  if (raised.space.num_nodes() == mesh_.space.num_nodes()) return false;
  const BoundarySamples samples = sheet_samples(raised.space);
  FitProblem raised_problem =
      problem(raised.space, volume_energy(raised.space), samples, schedule_.final_stage(lambda_));
  const EntityValues gains = order_gains(raised_problem, raised.space, mesh_.space.orders(), raised.coefficients);
  const double surface = raised_problem.surface->target_to_surface() + raised_problem.surface->surface_to_target();
  if (!(gains.sum() > tuning().least_order_gain * surface)) return false;
  set_orders(raised_where_it_pays(mesh_.space, next, gains, tuning().raised_share));
  return true;
}

/// Raises orders as long as it pays and the tolerance is not met. The rest is left to `lower_lambda`.
bool HighOrderFit::run_adaptive_orders() {
  stays_dense_ = true;
  while (!meets_tolerance() && raise_where_it_pays()) {
    take_own_boxes();
    if (!run_next_stage(schedule_.final_stage(schedule_.lambda_close))) return false;
  }
  return report_.stop_reason != StopReason::memory_limit;
}

/// Repeats the last stage with less and less weight on the cells' shape until the tolerance is met and the regions have
/// their volumes; if nothing is missed, only undoes the rise of lambda by unfolding. A stage that is interrupted or
/// leaves more than `pairs` self-intersections is rolled back.
bool HighOrderFit::lower_lambda(std::size_t pairs) {
  constexpr double kLeastHighOrderLambdaShare = 1e-3;  // of `lambda_close`: ten halvings
  const bool has_volumes = volume_percent() <= kAutomaticVolumePercent;
  const bool is_asked = options_.tolerance_percent || !has_volumes;
  const double least = (is_asked ? kLeastHighOrderLambdaShare : 1) * schedule_.lambda_close;
  const auto is_reached = [&] {
    return is_asked && (!options_.tolerance_percent || meets_tolerance()) &&
           (has_volumes || volume_percent() <= kAutomaticVolumePercent);
  };
  for (double lambda = lambda_ / 2; !is_reached() && lambda >= 0.99 * least; lambda /= 2) {
    const double before = measured_mean();
    FitSnapshot stiffer = snapshot();
    const std::optional<std::size_t> pairs_now =
        or_back(stiffer, [&] { return run_final_stage(lambda) ? intersecting_pairs() : std::nullopt; });
    if (!pairs_now || *pairs_now > pairs) {
      go_back(std::move(stiffer));
      return pairs_now.has_value();
    }
    pairs = *pairs_now;
    if (1 - measured_mean() / before < options_.tuning.fitting.least_lambda_halving_gain) break;
  }
  return true;
}

/// Runs the final stages, once the orders are those of the finished mesh. Improving the worst places also removes small
/// folds, so the last stage is only repeated (`unfold`) if folds remain after that.
bool HighOrderFit::finish() {
  std::optional<std::size_t> pairs = intersecting_pairs();
  if (!pairs || !lower_lambda(*pairs) || !improve_worst_places()) return false;
  if (*pairs > 0) pairs = intersecting_pairs();
  if (!pairs || *pairs == 0) return pairs.has_value();
  const std::size_t pairs_before = *pairs;
  emphasis_ = hinge_ = far_length_ = 0;
  if (!unfold(starts_.back(), options_.tuning.fitting.unfolding_factor, tuning().most_unfolding_lambda, *pairs))
    return false;
  return *pairs == pairs_before || (lower_lambda(*pairs) && improve_worst_places());
}

/// If the boundary of a fit that had to end early intersects itself, rolls back to the last start of a stage of the
/// schedule at which it did not, but not to the template. The searches for self-intersections come on top of the time
/// limit, so a fit that was cancelled is left as it is.
void HighOrderFit::leave_folds() {
  if (report_.stop_reason == StopReason::cancelled) return;
  const auto pairs_at = [&](std::vector<Vec3>& x) {
    x.swap(mesh_.coefficients);
    const std::size_t pairs = self_intersections(measured_boundary()).pairs.size();
    x.swap(mesh_.coefficients);
    return pairs;
  };
  const std::size_t pairs = self_intersections(measured_boundary()).pairs.size();
  if (pairs == 0) return;
  for (; starts_.size() > 1; starts_.pop_back()) {
    if (pairs_at(starts_.back().x) > 0) continue;
    go_back(std::move(starts_.back()));
    report_.explanation += formatted(
        "; %zu pairs of triangles of the boundary intersected then, so the fit went back to its state after %s", pairs,
        report_.last_kept_stage()->name.c_str());
    return;
  }
}

/// Repeats the last stage to improve a few places that hardly count in the energies, since these are means.
bool HighOrderFit::improve_worst_places() {
  if (!options_.improve_worst_places || options_.order < 2) return true;
  const std::optional<Outcome> first = measured_outcome(false);
  if (!first) return false;
  outcome_ = *first;
  most_max_ = std::max(tuning().most_distance_growth * outcome_.max_percent, tuning().allowed_max_percent);
  most_mean_ = options_.tolerance_percent
                   ? std::max(outcome_.mean_percent, *options_.tolerance_percent)
                   : std::max(tuning().most_distance_growth * outcome_.mean_percent, kNearMeanPercent);
  for (int round = 0; round < tuning().most_improvements; ++round) {
    const double far_length_before = far_length_;
    if (draw_in_far_places() == Again::ended) return false;
    if (round > 0 && far_length_ == far_length_before) break;  // the same lifts would fail again
    const std::pair settings_before(emphasis_, hinge_);
    if (lift_worst_places() == Again::ended) return false;
    if (std::pair(emphasis_, hinge_) == settings_before)
      break;  // otherwise, cells may now tolerate what they could not before
  }
  return true;
}

/// Returns true if the state is within the limits and better by the least scaled Jacobian (capped if good), divided by
/// the mean and by the largest distance.
bool HighOrderFit::is_better(const Outcome& next) const {
  const double good = std::max(kFairScaledJacobian, options_.quality);
  const auto shape = [&](const Outcome& x) { return std::min(x.least_scaled_jacobian, good); };
  const auto distances = [this](const Outcome& x) {
    return std::max(x.mean_percent, kNearMeanPercent) * std::max(x.max_percent, tuning().near_percent);
  };
  const double gain = distances(outcome_) / distances(next);
  return shape(next) > 0 && gain * shape(next) > shape(outcome_) && next.mean_percent <= most_mean_ &&
         next.max_percent <= most_max_ && next.pairs <= outcome_.pairs &&
         next.volume_percent <= std::max(outcome_.volume_percent, kAutomaticVolumePercent);
}

/// Repeats the last stage around some cells with one setting changed; if the result is not better, rolls back the stage
/// and the setting.
Again HighOrderFit::run_again(std::span<const Index> cells, double& setting, double value, int steps) {
  FitSnapshot before = snapshot();
  const double setting_before = std::exchange(setting, value);
  Stage stage = schedule_.final_stage(lambda_);
  stage.max_iterations = steps;
  std::optional<Outcome> next = or_back(
      before, [&] { return run_stage_around(cells, stage) ? measured_outcome(outcome_.pairs == 0) : std::nullopt; });
  if (next && is_better(*next)) {
    outcome_ = *std::move(next);
    return Again::kept;
  }
  go_back(std::move(before));
  setting = setting_before;
  return next ? Again::undone : Again::ended;
}

/// Puts more and more emphasis on places much farther off than the mean, as long as there are any.
Again HighOrderFit::draw_in_far_places() {
  Again last = Again::kept;
  if (options_.correspondence != Correspondence::closest) return last;
  for (int draw = 0; draw < tuning().most_draws && last == Again::kept; ++draw) {
    const double far = std::max(tuning().far_share * outcome_.mean_percent, tuning().near_percent);
    if (!(outcome_.max_percent > far)) break;
    const double first = kFirstFarLength * outcome_.mean_percent / 100;
    last = run_again(far_cells(kStartOfFar * far), far_length_, far_length_ == 0 ? first : far_length_ / 2,
                     tuning().draw_steps);
  }
  return last;
}

/// Repeats the last stage around poor cells with higher and higher values of a setting.
Again HighOrderFit::lift_by(double& setting, const LiftValues& values) {
  const auto is_poor = [&] {
    return outcome_.least_scaled_jacobian > 0 && outcome_.least_scaled_jacobian < options_.quality;
  };
  return lift(setting, values, tuning().most_failed_lifts, is_poor, [&](double value) {
    return run_again(poor_cells(outcome_.cell_minima, options_.quality), setting, value, tuning().lift_steps);
  });
}

/// Weighs places of poor shape more, and then penalizes their scaled Jacobians, as long as there are any. The penalty
/// comes second: by itself, it does not lift cells that are nearly flat.
Again HighOrderFit::lift_worst_places() {
  if (lift_by(emphasis_, kEmphases) == Again::ended) return Again::ended;
  return lift_by(hinge_, kHinges);
}

HighOrderFitResult HighOrderFit::run() {
  look_over_template();
  const int first = std::min(schedule_.first_orders(options_.adaptive), options_.order);
  return concluded([&] {
    return run_first_orders(first) && (options_.adaptive ? run_adaptive_orders() : run_higher_orders()) && finish();
  });
}

/// Makes the present interfaces part of the target, unless it has some of its own.
void HighOrderFit::keep_curved_interfaces() {
  constexpr int kInterfaceIntervalsPerOrder = 4;  // chords of a part of an edge are then closer than the fit is
  if (order_ == 1) return;
  const std::vector<Index> groups = groups_of_sheets(template_, mesh_.space.topology());
  const BoundarySamples samples = make_sheet_samples(mesh_.space, template_, kInterfaceIntervalsPerOrder * order_);
  TriangleMesh interfaces{samples.positions.apply(mesh_.coefficients), {}};
  std::vector<Index> group_of_triangle;
  for (std::size_t t = 0; t < samples.triangles.size(); ++t) {
    const Index face = samples.triangle_faces[t];
    if (mesh_.space.topology().is_boundary_face(face)) continue;
    interfaces.triangles.push_back(samples.triangles[t]);
    group_of_triangle.push_back(groups[face]);
  }
  if (!interfaces.triangles.empty()) target_.keep_interfaces(std::move(interfaces), std::move(group_of_triangle));
}

HighOrderFitResult HighOrderFit::run_from(const HighOrderMesh& start) {
  mesh_ = in_unit(start);
  set_orders(mesh_.space.orders());
  keep_curved_interfaces();
  look_over_template();
  EntityOrders orders = mesh_.space.orders();
  for (std::vector<int>* of_entities : {&orders.edges, &orders.faces, &orders.cells})
    for (int& order : *of_entities) order = std::max(order, options_.order);
  options_.order = std::max(options_.order, mesh_.space.max_order());
  return concluded([&] {
    if (!has_room(orders)) return false;
    set_orders(orders);
    try_ = 1;
    take_own_boxes();
    for (const Stage& stage : schedule_.stages(approach_, order_, order_))
      if (!run_next_stage(stage)) return false;
    stays_dense_ = true;
    return finish();
  });
}

/// Does the work and returns the result in the target's unit. work(): returns false if the fit must end.
template <class Work>
HighOrderFitResult HighOrderFit::concluded(const Work& work) {
  try {
    if (work())
      runner_.conclude(measured_mean(), options_.tolerance_percent, report_);
    else
      leave_folds();
  } catch (const std::bad_alloc&) {
    end_for_memory(formatted("no memory was left at order %d", order_));
  }
  report_.creases = measured_creases();
  if (report_.creases) report_.creases->farthest = target_.normalization.from_unit({report_.creases->farthest})[0];
  report_.seconds = {{"total", runner_.seconds()}};
  mesh_.coefficients = in_target_units(std::move(mesh_.coefficients));
  for (FitState& state : states_) state.positions = in_target_units(std::move(state.positions));
  return {std::move(mesh_), std::move(report_), schedule_.lambda_close, std::move(states_)};
}

}  // namespace

namespace {

/// Fits cells to a target, with its interfaces if they have the same regions.
/// control: of the fit.  fit: fits the cells to one target.
template <class Fit>
HighOrderFitResult fit_matched(const TriangleMesh& target, const VolumeMesh& cells, const SolveControl& control,
                               const Fit& fit) {
  const MatchedTarget matched = matched_target(target, cells, control.cancelled);
  if (matched.regions) return fit(FitTarget(*matched.regions));
  HighOrderFitResult result = fit(FitTarget(matched.outer ? *matched.outer : target));
  if (!matched.warning.empty()) result.report.warnings.insert(result.report.warnings.begin(), matched.warning);
  return result;
}

}  // namespace

HighOrderFitResult fit_high_order(const TriangleMesh& target, const VolumeMesh& template_mesh,
                                  const HighOrderFitOptions& options) {
  return fit_matched(target, template_mesh, options.control,
                     [&](FitTarget matched) { return HighOrderFit(std::move(matched), template_mesh, options).run(); });
}

HighOrderFitResult fit_high_order(const TriangleMesh& target, const HighOrderMesh& start, const VolumeMesh& labels,
                                  const HighOrderFitOptions& given) {
  VolumeMesh cells = start.straight_sided();
  if (labels.kinds != cells.kinds || labels.cell_vertices != cells.cell_vertices)
    throw InputError("fit_high_order: the labels belong to other cells");
  cells.references = labels.references;
  cells.regions = labels.regions;
  cells.tags = labels.tags;
  cells.face_groups = labels.face_groups;
  HighOrderFitOptions options = given;
  options.basis = start.space.basis();
  return fit_matched(target, cells, options.control, [&](FitTarget matched) {
    return HighOrderFit(std::move(matched), cells, options).run_from(start);
  });
}

HighOrderFitResult fit_high_order(const PointCloud& target, const VolumeMesh& template_mesh,
                                  const HighOrderFitOptions& options) {
  if (options.crease_angle_degrees)
    throw InputError("HighOrderFitOptions::crease_angle_degrees: points have no edges to be kept sharp");
  require_closest(options.correspondence);
  return HighOrderFit(FitTarget(target, options.point_weights), template_mesh, options).run();
}

}  // namespace subvol
