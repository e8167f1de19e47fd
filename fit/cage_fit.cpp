// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/cage_fit.h"

#include "subvol/base/format.h"
#include "subvol/fit/fits/flat_faces.h"
#include "subvol/fit/subdivision_driver.h"

#include <algorithm>
#include <array>
#include <functional>
#include <new>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace subvol::internal {

namespace {

/// The recursive fit: its sequence of levels and stages, and what raises the quality of the finest mesh.
class SubdivisionFit : SubdivisionDriver {
 public:
  SubdivisionFit(FitTarget target, const VolumeMesh& template_mesh, const FitOptions& options, int levels_before)
      : SubdivisionDriver(std::move(target), template_mesh, options, levels_before) {}
  FitResult run();
  /// See `CageFit::lifted`.
  VolumeMesh take_lifted_mesh() { return std::move(lifted_mesh_); }

 private:
  bool run_levels();
  bool run_level();
  bool run_stages();
  bool improve_finest(const FitSnapshot& start);
  bool lower_lambda(std::size_t pairs);
  bool raise_quality();
  bool flatten_interfaces();

  VolumeMesh lifted_mesh_;  ///< of the attempt with the best cells
  double lifted_jacobian_ = 0;
};

/// Repeats the finest level with less and less weight on the cells' shape, until the wanted accuracy is reached.
/// Without a tolerance, it also ends if a stage costs more (relative rise of E_W) than it gains (relative decrease of
/// the mean distance). A stage is rolled back if it is interrupted, if it leaves more than `pairs` self-intersections
/// of the boundary, or, without a tolerance, if the total loss of shape is too large.
bool SubdivisionFit::lower_lambda(std::size_t pairs) {
  const double wanted = options_.tolerance_percent.value_or(options_.tuning.fitting.default_accuracy_percent);
  const double least =
      options_.lambda_close * (options_.tolerance_percent ? options_.tuning.fitting.least_lambda_share
                                                          : options_.tuning.fitting.least_default_lambda_share);
  const auto distortion = [this] {
    const StageRecord* stage = result_.report.last_kept_stage();
    return !stage || stage->iterations.empty() ? 0 : stage->iterations.back().volume_energy;
  };
  double mean = measured_mean(), volume = distortion();
  const double shape = mean_scaled_jacobian();
  const double most_loss =
      options_.cage_only ? options_.tuning.fitting.most_cage_shape_loss : options_.tuning.fitting.most_shape_loss;
  for (double lambda = lambda_ / 2; mean > wanted && lambda >= 0.99 * least; lambda /= 2) {
    FitSnapshot stiffer = snapshot();
    if (!run_final_stage(lambda)) {
      go_back(std::move(stiffer));
      return false;
    }
    const double gain = 1 - measured_mean() / mean, cost = volume > 0 ? distortion() / volume - 1 : 0;
    const double loss = shape - mean_scaled_jacobian();
    const std::optional<std::size_t> pairs_now = intersecting_pairs();
    if (!pairs_now || *pairs_now > pairs || (!options_.tolerance_percent && loss > most_loss)) {
      go_back(std::move(stiffer));
      return pairs_now.has_value();
    }
    mean = measured_mean();
    volume = distortion();
    pairs = *pairs_now;
    const double least_gain = options_.tuning.fitting.least_lambda_halving_gain;
    if (gain < (options_.tolerance_percent ? least_gain : std::max(least_gain, cost))) break;
  }
  return true;
}

/// An attempt to raise the quality of the finest mesh: a lift from the state before, or all quality stages from the
/// state of the last attempt, which draw the surface back.
struct QualityAttempt {
  enum class Kind { lift, draw_back };
  Kind kind;
  double surface;      ///< factor of the surface's weight
  bool worst_patches;  ///< `QualitySchedule::lifts_worst_of_cage`
};

/// The attempts, which are made in this order until the quality has risen and the distances have not suffered. A cage
/// has few degrees of freedom, so its surface suffers more than that of a mesh whose vertices are all free, and counts
/// more here. First the cells are lifted. Then the surface is drawn back with more and more weight, while the hinge
/// keeps the cells as they are: femur180 at level 2 rises from 0.008 to 0.60 by the lift, but is 8 % farther from the
/// target then; drawn back, it has 0.53 and is 4 % farther. If none of this has gained, the same is done around the
/// worst cells alone.
constexpr std::array<QualityAttempt, 9> kQualityAttempts{{{QualityAttempt::Kind::lift, 10, false},
                                                          {QualityAttempt::Kind::draw_back, 100, false},
                                                          {QualityAttempt::Kind::draw_back, 300, false},
                                                          {QualityAttempt::Kind::draw_back, 1000, false},
                                                          {QualityAttempt::Kind::draw_back, 10000, false},
                                                          {QualityAttempt::Kind::lift, 10, true},
                                                          {QualityAttempt::Kind::draw_back, 100, true},
                                                          {QualityAttempt::Kind::draw_back, 1000, true},
                                                          {QualityAttempt::Kind::draw_back, 10000, true}}};

/// Raises the lowest scaled Jacobians of the finest mesh as far as the distances do not suffer, or rolls back. Returns
/// false if the fit must end.
bool SubdivisionFit::raise_quality() {
  const QualityTuning& tuning = options_.tuning.quality;
  const StageRecord* last = result_.report.last_kept_stage();
  if (options_.quality == 0 || (last && last->ended == MinimizerStop::infeasible_start)) return true;
  const std::optional<Measured> before = measure();
  if (!before) return false;
  if (before->least_jacobian >= options_.quality) return true;
  runner_.work().begin_part(1, late_quality_schedule(options_.quality, tuning).expected_steps());
  FitSnapshot best = snapshot();
  double best_jacobian = before->least_jacobian;
  const bool is_poor = before->least_jacobian < tuning.poor_share * options_.quality;
  bool is_lifted = false;
  const std::size_t most =
      options_.frees_mesh ? static_cast<std::size_t>(tuning.attempts_before_freeing) : kQualityAttempts.size();
  const auto attempts = std::span(kQualityAttempts).first(std::min(most, kQualityAttempts.size()));
  for (const QualityAttempt& attempt : attempts) {
    const bool has_gained = best_jacobian > before->least_jacobian;
    const bool is_lift = attempt.kind == QualityAttempt::Kind::lift;
    if (has_gained && (is_lift || best_jacobian >= tuning.enough_of_goal * options_.quality)) break;
    if (!is_lift && !(is_poor && is_lifted)) continue;
    if (is_lift) go_back(best);
    QualitySchedule schedule =
        is_lift ? late_quality_schedule(options_.quality, tuning) : fine_quality_schedule(options_.quality, tuning);
    schedule.most_distance = (is_lift ? 1 : tuning.max_margin) * before->largest();
    schedule.give_surface_more_weight(attempt.surface);
    schedule.lifts_worst_of_cage = attempt.worst_patches;
    if (!is_lift) schedule.lift.steps = std::min(schedule.lift.steps, tuning.later_lift_steps);
    const bool going = or_back(best, [&] { return run_quality_stages(schedule); });
    std::optional<Measured> now = going ? measure() : std::nullopt;
    if (!now) {
      if (result_.report.stop_reason == StopReason::time_limit) now = measure(true);
      const bool gains = now && now->gains_on(*before, options_.tolerance_percent, tuning);
      if (!gains || now->least_jacobian <= best_jacobian) go_back(std::move(best));
      return false;
    }
    is_lifted = now->least_jacobian > before->least_jacobian;
    if (options_.frees_mesh && now->least_jacobian > std::max(lifted_jacobian_, before->least_jacobian)) {
      lifted_jacobian_ = now->least_jacobian;
      lifted_mesh_ = current_mesh();
      lifted_mesh_.positions = target_.normalization.from_unit(std::move(lifted_mesh_.positions));
    }
    if (!now->gains_on(*before, options_.tolerance_percent, tuning)) continue;
    if (now->least_jacobian <= best_jacobian) break;  // more weight of the surface would not help
    best_jacobian = now->least_jacobian;
    best = snapshot();
  }
  go_back(std::move(best));
  return true;
}

/// Makes flat interfaces exactly so, unless the cells suffer. Returns false if the fit must end.
bool SubdivisionFit::flatten_interfaces() {
  constexpr double kLeastFlattenedJacobianShare = 0.98;  // of the least scaled Jacobian
  if (!target_.has_interfaces()) return true;
  const std::optional<Measured> before = measure();
  if (!before) return false;
  FitSnapshot start = snapshot();
  VolumeMesh cage = cage_;
  cage.positions = unknowns_;
  if (flatten_interface_patches(cage, target_) == 0) return true;
  unknowns_ = std::move(cage.positions);
  mean_.reset();
  const std::optional<Measured> now = measure();
  if (now && now->uncertified <= before->uncertified && now->pairs <= before->pairs &&
      now->least_jacobian >= kLeastFlattenedJacobianShare * before->least_jacobian)
    return true;
  go_back(std::move(start));
  return now.has_value();
}

bool SubdivisionFit::run_stages() {
  const FitSnapshot start = snapshot();
  for (const Stage& stage : schedule_.stages(number_)) {
    if (!run_stage(stage)) return false;
    if (stage.lambda <= options_.lambda_close && finest() && meets_tolerance()) break;
  }
  if (!finest()) return true;
  return improve_finest(start);
}

/// Improves the finest mesh step by step. If memory runs out, the state before the step is the result.
/// start  of the level. Returns false if the fit must end.
bool SubdivisionFit::improve_finest(const FitSnapshot& start) {
  std::optional<std::size_t> pairs = intersecting_pairs();
  if (!pairs) return false;
  const std::array<std::function<bool()>, 5> steps{
      [&] {
        return unfold(start, options_.tuning.fitting.unfolding_factor, options_.tuning.fitting.most_unfolding_lambda,
                      *pairs);
      },
      [&] { return lower_lambda(*pairs); }, [&] { return fit_all_samples(); }, [&] { return raise_quality(); },
      [&] { return flatten_interfaces(); }};
  for (const std::function<bool()>& step : steps) {
    FitSnapshot before = snapshot();
    try {
      if (!or_back(before, step)) return false;
    } catch (const std::bad_alloc&) {
      result_.report.stop_reason = StopReason::memory_limit;
      result_.report.explanation = formatted("no memory was left to improve level %d", level());
      return false;
    }
  }
  return true;
}

bool SubdivisionFit::run_level() {
  runner_.work().begin_part(schedule_.share_at_end(number_, options_.quality > 0), kExpectedLevelSteps);
  prepare_level();
  const bool going = start_level() && run_stages();
  store_result();
  return going;
}

/// Runs one attempt on all levels, with one choice of ideal cells. Returns false if it ended early.
bool SubdivisionFit::run_levels() {
  for (number_ = 1;; ++number_) {
    if (!has_room() || (number_ > 1 && !runner_.in_time(formatted("level %d", level()), result_.report))) return false;
    try {
      if (!run_level()) return false;
      if (finest() || meets_tolerance()) return true;
      next_control();
    } catch (const std::bad_alloc&) {
      level_ = {};
      return end_for_memory(formatted("no memory was left in level %d", level()));
    }
  }
}

FitResult SubdivisionFit::run() {
  look_over_template();
  bool done = false;
  struct Stalled {
    FitResult result;
    StageRange stages;
  };
  std::optional<Stalled> best;  // the stalled attempt that reached the finest mesh
  for (double share : schedule_.own_box_shares) {
    begin(share);
    done = run_levels();
    if (done || result_.report.stop_reason != StopReason::stalled) break;
    if (!best || result_.mesh.num_cells() > best->result.mesh.num_cells()) best = {result_, result_stages_};
  }
  const bool stalled = result_.report.stop_reason == StopReason::stalled;
  if (best && !done && (stalled || best->result.mesh.num_cells() > result_.mesh.num_cells())) {
    FitReport last = std::exchange(result_, std::move(best->result)).report;
    result_stages_ = best->stages;
    result_.report.stages = std::move(last.stages);
    if (!stalled) {  // the fit was ended in a later attempt
      result_.report.stop_reason = last.stop_reason;
      result_.report.explanation = std::move(last.explanation);
    }
  }
  FitReport& report = result_.report;
  report.undo_stages(0, result_stages_.begin);
  report.undo_stages(result_stages_.end, report.stages.size());
  if (done) runner_.conclude(measured_mean(), options_.tolerance_percent, report);
  report.seconds.assign(seconds_.begin(), seconds_.end());
  return std::move(result_);
}

}  // namespace

CageFit fit_cage(FitTarget target, const VolumeMesh& template_mesh, const FitOptions& options, int levels_before) {
  SubdivisionFit fit(std::move(target), template_mesh, options, levels_before);
  FitResult result = fit.run();
  return {std::move(result), fit.take_lifted_mesh()};
}

}  // namespace subvol::internal
