// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/optimize_mesh.h"

#include "subvol/base/format.h"
#include "subvol/base/text_scanner.h"
#include "subvol/fit/certificate/certificate.h"
#include "subvol/fit/elements/ideal_boxes.h"
#include "subvol/fit/fits/flat_faces.h"
#include "subvol/fit/fits/region_volumes.h"
#include "subvol/fit/optimize_driver.h"
#include "subvol/fit/quality/quality.h"
#include "subvol/fit/stages/quality_stages.h"
#include "subvol/fit/stages/untangle.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

namespace subvol {

using namespace internal;

namespace {

/// Weight of the cells' shape against the surface while cells are untangled with a sliding boundary.
constexpr double kUntangleLambda = 0.01;

/// Estimates of the work: its share when untangling and the rounds end, the portion of the rest that the first quality
/// stages take, and the steps of untangling.
constexpr double kShareAfterUntangling = 0.25, kShareAfterRounds = 0.5, kFirstQualityPortion = 0.7;
constexpr double kExpectedUntanglingSteps = 30;

/// State that a round has reached.
struct Progress {
  double mean_jacobian = -1, least_jacobian = -1, max_percent = 0;

  bool gains_on(const Progress& before, double wanted_percent) const {
    // Least rise of the mean scaled Jacobian, of the least one, and least relative fall of the distance: one of them
    // must be reached for another round to be worth its time.
    constexpr double kLeastMeanJacobianGain = 7e-4, kLeastOfWorst = 5e-3, kLeastApproach = 0.03;
    return mean_jacobian - before.mean_jacobian >= kLeastMeanJacobianGain ||
           least_jacobian - before.least_jacobian >= kLeastOfWorst ||
           (max_percent > wanted_percent && max_percent < (1 - kLeastApproach) * before.max_percent);
  }
};

/// Returns a warning about groups of faces inside regions, if some have left their planes: nothing holds these.
std::optional<std::string> inner_groups_warning(const VolumeMesh& before, const VolumeMesh& after,
                                                const MeshTopology& topology, double diagonal) {
  constexpr double kLeastReportedMove = 1e-6;  // of the diagonal
  const auto reference = [&](Index cell) { return before.references.empty() ? 0 : before.references[cell]; };
  double most = 0;
  Index moved = kNoIndex;
  for (std::size_t f = 0; f < topology.num_faces() && !before.face_groups.empty(); ++f) {
    const auto [first, second] = topology.face_cells(static_cast<Index>(f));
    if (second == kNoIndex || reference(first) != reference(second)) continue;
    const auto corners = topology.face(static_cast<Index>(f));
    const Index group = group_of(before.face_groups, corners);
    if (group == kNoIndex) continue;
    const auto& x = before.positions;
    const Vec3 normal =
        (x[corners[2]] - x[corners[0]]).cross(x[corners[corners.size() - 1]] - x[corners[1]]).stableNormalized();
    for (const Index v : corners)
      if (const double way = std::abs(normal.dot(after.positions[v] - x[v])); way > most) most = way, moved = group;
  }
  if (most <= kLeastReportedMove * diagonal) return std::nullopt;
  const Group& group = before.face_groups.groups[moved];
  return formatted(
      "faces of the group %s inside the mesh left their planes by up to %.3g %% of the diagonal: only the "
      "boundary and interfaces between regions are held",
      group.name.empty() ? std::to_string(group.number).c_str() : in_quotes(group.name).c_str(), 100 * most / diagonal);
}

double mean_of(std::span<const double> values) {
  double sum = 0;
  for (const double v : values) sum += v;
  return sum / static_cast<double>(values.size());
}

/// One optimization: its sequence of untangling, rounds and quality stages, and what is kept in the end.
class MeshOptimizer : OptimizeDriver {
 public:
  MeshOptimizer(const VolumeMesh& mesh, const TriangleMesh* target, const OptimizeOptions& options)
      : OptimizeDriver(mesh, target, options) {}
  OptimizeResult run(const VolumeMesh& original);

 private:
  bool attempt(double least_jacobian);
  bool untangle_all();
  bool untangle_cells(Boundary boundary, const char* name, const UntangleOptions& options);
  bool improve();
  bool is_better(const Measured& now, const Measured& before) const;
  void flatten(double least_jacobian);
  void keep_volumes();
  bool raise_quality(double goal);
  bool raise_quality();
  bool is_worth_keeping(const Measured& now, const Measured& start) const;
  bool steps_ran_out() const;
  void finish(bool going);

  /// Holds the state that an attempt reached.
  struct Outcome {
    std::vector<Vec3> positions;
    std::size_t num_uncertified;
    double volume_change;
    Held held;
    std::vector<std::string> warnings;
    std::vector<bool> kept;  ///< by stage of the report

    /// Validity counts first, then the volumes of regions.
    bool is_sounder_than(const Outcome& other) const {
      return std::tie(num_uncertified, volume_change) < std::tie(other.num_uncertified, other.volume_change);
    }
  };
  const OptimizeTuning& tuning() const { return options_.tuning.optimize; }
  Outcome outcome() const;
  /// Makes attempts that hold more and more until no region's volume changes, and takes the soundest. start: the state
  /// before. Returns false if the work must end.
  bool attempt_soundly(const Measured& start, const VolumeMesh& original);
  bool repeat_while_poor(const VolumeMesh& original);
  /// Makes an outcome the present state again.
  void take(Outcome reached);

  std::vector<Index> uncertified_;
  /// Cells below this scaled Jacobian may move corners of sharp edges.
  double releases_below_ = options_.tuning.optimize.poor_jacobian;
  bool gains_ended_ = false;  ///< true if the rounds ended because they no longer gained
};

bool MeshOptimizer::untangle_cells(Boundary boundary, const char* name, const UntangleOptions& options) {
  std::vector<Vec3> x;
  FitProblem problem = make_problem(boundary, boundary == Boundary::fixed ? 1 : kUntangleLambda, true, x);
  UntangleResult result = untangle(problem, mesh_.num_cells(), options, runner_, record(name), x, report_);
  problem.apply_nodes(x, mesh_.positions);
  uncertified_ = std::move(result.uncertified);
  return result.going;
}

bool MeshOptimizer::untangle_all() {
  runner_.work().begin_part(kShareAfterUntangling, kExpectedUntanglingSteps);
  const std::vector<Vec3> start = mesh_.positions;
  const UntangleOptions fixed{
      .tangential_weight = 0, .max_rounds = 40, .patience = options_.fixed_boundary ? 6 : 2, .tuning = tuning()};
  if (!untangle_cells(Boundary::fixed, "untangle, boundary fixed", fixed)) return false;
  if (uncertified_.empty() || options_.fixed_boundary) return true;
  std::vector<Index> stuck = uncertified_;
  release_corners(stuck);
  const UntangleOptions sliding{.tangential_weight = kOptimizeTangentialWeight, .max_rounds = 4, .tuning = tuning()};
  if (!untangle_cells(Boundary::sliding, "untangle, boundary sliding", sliding)) return false;
  if (uncertified_.empty()) return true;
  stuck.insert(stuck.end(), uncertified_.begin(), uncertified_.end());
  release_features(stuck);
  mesh_.positions = start;
  return untangle_cells(Boundary::sliding, "untangle, sharp edges released",
                        {.tangential_weight = kOptimizeTangentialWeight, .tuning = tuning()});
}

/// Runs rounds of a few steps; between them, ideal boxes, weights and lambda are adapted to the state reached.
bool MeshOptimizer::improve() {
  const int first_steps = tuning().first_round_steps, round_steps = tuning().round_steps;
  const int most_rounds = tuning().most_rounds;
  constexpr double kLeastShareOfLambda = 1.0 / 64;  // of the first lambda: six halvings
  double lambda = options_.lambda;
  Progress before;
  runner_.work().begin_part(kShareAfterRounds, first_steps + round_steps * most_rounds / 2);
  if (!run_stage(formatted("improve, lambda %g", lambda), lambda, first_steps)) return false;
  for (int round = 0; round < most_rounds; ++round) {
    const std::vector<double> minima = measure_quality(mesh_, kCornerPoints).cell_minima;
    const Progress now{mean_of(minima), *std::min_element(minima.begin(), minima.end()), max_percent_};
    const bool too_far = mean_percent_ > tuning().mean_share_of_tolerance * options_.mean_tolerance_percent ||
                         (held_ != Held::nothing && changes_volumes());
    if (too_far && lambda > kLeastShareOfLambda * options_.lambda) {
      lambda /= 2;
    } else if (!now.gains_on(before, tuning().max_share_of_tolerance * options_.max_tolerance_percent)) {
      gains_ended_ = true;
      break;
    }
    before = now;
    if (options_.sizes == CellSizes::local)
      ideal_boxes_ = ideal_boxes(mesh_, mesh_.positions, target_.surface.volume(), 1);
    std::vector<Index> poor;
    for (std::size_t c = 0; c < minima.size(); ++c)
      if (minima[c] < releases_below_) poor.push_back(static_cast<Index>(c));
    release_corners(poor);
    weigh_cells(minima);
    if (!run_stage(formatted("round %d, lambda %g", round + 1, lambda), lambda, round_steps)) return false;
  }
  return true;
}

bool MeshOptimizer::is_better(const Measured& now, const Measured& before) const {
  return now.uncertified <= before.uncertified && now.intersections <= before.intersections &&
         now.least_jacobian > before.least_jacobian &&
         now.volume_change <= std::max(before.volume_change, tuning().most_volume_change) &&
         now.mean_percent <=
             std::max(before.mean_percent, tuning().mean_share_of_tolerance * options_.mean_tolerance_percent) &&
         now.max_percent <= std::max(before.max_percent, options_.max_tolerance_percent);
}

/// Returns true if a result is better than a start whose cells are all certified: closer to a surface that the start
/// was too far from, or of better cells at distances that are within the tolerances or no larger.
bool MeshOptimizer::is_worth_keeping(const Measured& now, const Measured& start) const {
  const double mean_limit = options_.mean_tolerance_percent, max_limit = options_.max_tolerance_percent;
  if (now.uncertified > 0 || now.intersections > start.intersections ||
      now.volume_change > tuning().most_volume_change || now.mean_percent > std::max(start.mean_percent, mean_limit) ||
      now.max_percent > std::max(start.max_percent, max_limit))
    return false;
  const bool was_too_far = start.mean_percent > mean_limit || start.max_percent > max_limit;
  if (was_too_far) return now.mean_percent < start.mean_percent || now.max_percent < start.max_percent;
  const double gain = now.least_jacobian - start.least_jacobian;
  return gain > kLeastJacobianGain ||
         (gain > -kLeastJacobianGain && now.mean_jacobian > start.mean_jacobian + kLeastJacobianGain);
}

/// Raises the least scaled Jacobian toward a goal; if the surface suffers, it counts more in another attempt. Returns
/// false if the work must end.
bool MeshOptimizer::raise_quality(double goal) {
  constexpr int kSurfaceWeightAttempts = 2;  // with its weight as it is, and with more
  const Measured before = measure();
  if (before.least_jacobian >= goal) return true;
  const std::vector<Vec3> start = mesh_.positions;
  QualitySchedule schedule = fine_quality_schedule(goal, options_.tuning.quality);
  runner_.work().begin_portion(kFirstQualityPortion, 1, schedule.expected_steps());
  schedule.most_distance =
      std::max(tuning().max_share_of_tolerance * options_.max_tolerance_percent, before.max_percent) / 100;
  for (int attempt = 0; attempt < kSurfaceWeightAttempts; ++attempt) {
    const std::size_t stages_before = report_.stages.size();
    const bool going = run_quality_stages(schedule);
    if (is_better(measure(), before)) return going;
    mesh_.positions = start;
    report_.undo_stages(stages_before, report_.stages.size());
    if (!going) return false;
    if (options_.fixed_boundary) break;
    schedule.give_surface_more_weight(tuning().more_surface);
  }
  return true;
}

/// Raises the least scaled Jacobian to the quality that was asked for and then, from there, beyond it. Returns false if
/// the work must end.
bool MeshOptimizer::raise_quality() {
  if (options_.quality == 0) return true;
  if (!raise_quality(options_.quality)) return false;
  if (measure_quality(mesh_).min_scaled_jacobian < options_.quality) return true;
  return raise_quality(std::min(kMostQuality, options_.quality + tuning().quality_beyond_aim));
}

/// Makes flat faces exactly so, unless the boundary is fixed. least_jacobian: of the start.
void MeshOptimizer::flatten(double least_jacobian) {
  if (options_.fixed_boundary) return;
  flatten_sheets(mesh_, target_, std::max(least_jacobian, 0.0));
}

/// Gives all regions the volumes that they had at the start (`keeps_volumes`).
void MeshOptimizer::keep_volumes() {
  constexpr double kKeptQuality = 0.99;  // share of the least scaled Jacobian that must be left
  if (!keeps_volumes()) return;
  restore_volumes(mesh_, start_volumes_, kKeptQuality * measure_quality(mesh_).min_scaled_jacobian);
}

/// Returns true if the caller's limit of steps, not the schedule's, ended a minimization.
bool MeshOptimizer::steps_ran_out() const {
  return options_.control.max_iterations > 0 &&
         std::any_of(report_.stages.begin(), report_.stages.end(), [](const StageRecord& stage) {
           return stage.kept && !stage.raises_quality && stage.ended == MinimizerStop::iteration_limit;
         });
}

void MeshOptimizer::finish(bool going) {
  measure_creases();
  if (going) measure_distance();
  report_.seconds = {{"total", runner_.seconds()}};
  if (!going) return;
  if (!uncertified_.empty()) {
    report_.stop_reason = StopReason::stalled;
    report_.explanation = formatted("%zu cells could not be made valid", uncertified_.size());
  } else if (mean_percent_ > options_.mean_tolerance_percent || max_percent_ > options_.max_tolerance_percent) {
    report_.stop_reason = StopReason::tolerance_missed;
    report_.explanation =
        formatted("the boundary is farther from its surface than asked for: mean %.4g %%, largest %.4g %%",
                  mean_percent_, max_percent_);
  } else {
    const bool cut_short = steps_ran_out();
    report_.explanation = formatted("all cells are valid%s; boundary within %.4g %% of its surface",
                                    gains_ended_ && !cut_short ? " and no longer gain" : "", max_percent_);
    if (cut_short)
      report_.explanation += formatted("; stages took all of the %d steps allowed", options_.control.max_iterations);
  }
}

/// Does the whole work on the present mesh. least_jacobian: of the start. Returns false if the work was ended early.
bool MeshOptimizer::attempt(double least_jacobian) {
  weights_.clear();
  relief_.assign(mesh_.num_cells(), 1);
  find_features();
  find_sizes();
  uncertified_ = certify(mesh_).not_certified;
  bool going = uncertified_.empty() || untangle_all();
  // Cells that are positive at their quadrature points but not certified may still become valid.
  going = going && improve() && raise_quality();
  flatten(least_jacobian);
  keep_volumes();
  return going;
}

MeshOptimizer::Outcome MeshOptimizer::outcome() const {
  Outcome reached{mesh_.positions, certify(mesh_).not_certified.size(), volume_change(), held_, report_.warnings, {}};
  for (const StageRecord& stage : report_.stages) reached.kept.push_back(stage.kept);
  return reached;
}

void MeshOptimizer::take(Outcome reached) {
  mesh_.positions = std::move(reached.positions);
  held_ = reached.held;
  report_.warnings = std::move(reached.warnings);
  for (std::size_t i = 0; i < report_.stages.size(); ++i)
    report_.stages[i].kept = i < reached.kept.size() && reached.kept[i];
}

bool MeshOptimizer::attempt_soundly(const Measured& start, const VolumeMesh& original) {
  const std::vector<Vec3> positions = mesh_.positions;
  const std::vector<std::string> warnings = report_.warnings;
  bool going = attempt(start.least_jacobian);
  Outcome soundest = outcome();
  while (going && keeps_volumes() && !interfaces_.empty() && held_ != Held::sheets && changes_volumes()) {
    report_.undo_stages(0, report_.stages.size());
    mesh_.positions = positions;
    mesh_.tags = original.tags;
    report_.warnings = warnings;
    held_ = static_cast<Held>(static_cast<int>(held_) + 1);
    going = attempt(start.least_jacobian);
    Outcome reached = outcome();
    if (!soundest.is_sounder_than(reached)) soundest = std::move(reached);
  }
  take(std::move(soundest));
  return going;
}

/// Does the work again from the state reached, as long as the quality is missed and the least scaled Jacobian rises:
/// ideal boxes and correspondences are others by then, and all cells below the quality may move corner vertices. A mesh
/// with interfaces has been through several attempts and is left as it is. Returns false if the work must end.
bool MeshOptimizer::repeat_while_poor(const VolumeMesh& original) {
  constexpr int kMostRepeats = 2;
  constexpr double kLeastRepeatGain = 0.01;  // of the least scaled Jacobian, for which there is another repeat
  if (options_.quality == 0 || !interfaces_.empty()) return true;
  releases_below_ = std::max(tuning().poor_jacobian, options_.quality);
  Measured before = measure();
  for (int i = 0; i < kMostRepeats && before.uncertified == 0 && before.least_jacobian < options_.quality; ++i) {
    Outcome reached = outcome();
    mesh_.tags = original.tags;
    const bool going = attempt(before.least_jacobian);
    const Measured now = measure();
    const bool is_gain = is_better(now, before);
    if (!is_gain) take(std::move(reached));
    if (!going) return false;
    if (!is_gain || now.least_jacobian < before.least_jacobian + kLeastRepeatGain) break;
    before = now;
  }
  return true;
}

OptimizeResult MeshOptimizer::run(const VolumeMesh& original) {
  measure_start();
  const Measured start = measure();
  std::vector<Vec3> start_positions = mesh_.positions;
  const std::size_t warnings_before = report_.warnings.size();
  const bool going = attempt_soundly(start, original) && repeat_while_poor(original);
  OptimizeResult result{original, {}, {}};
  const bool wants_other_sizes = options_.sizes == CellSizes::uniform;
  const bool is_kept = start.uncertified == 0 && !wants_other_sizes
                           ? is_worth_keeping(measure(), start)
                           : certify(mesh_).not_certified.size() <= start.uncertified;
  if (is_kept) {
    result.mesh.positions = target_.normalization.from_unit(mesh_.positions);
    if (held_ >= Held::interfaces)
      report_.warnings.push_back(formatted(
          "%s between regions were fixed: sliding changed the volume of a region by more than %g %%",
          held_ == Held::interfaces ? "interfaces" : "the boundary and interfaces", 100 * tuning().most_volume_change));
  } else {
    mesh_.positions = std::move(start_positions);
    report_.warnings.resize(warnings_before);
    report_.undo_stages(0, report_.stages.size());
    gains_ended_ = true;
  }
  if (const double change = volume_change(); keeps_volumes() && change > tuning().told_volume_change)
    report_.warnings.push_back(
        formatted("the volume of %s changed by %.2g %%", interfaces_.empty() ? "the mesh" : "a region", 100 * change));
  if (options_.fixed_boundary)
    for (std::size_t v = 0; v < original.num_vertices(); ++v)
      if (topology_.is_boundary_vertex(static_cast<Index>(v))) result.mesh.positions[v] = original.positions[v];
  if (const auto warning = inner_groups_warning(original, result.mesh, topology_, target_.normalization.diagonal))
    report_.warnings.push_back(*warning);
  uncertified_ = certify(result.mesh).not_certified;
  finish(going);
  result.uncertified = std::move(uncertified_);
  result.report = std::move(report_);
  return result;
}

}  // namespace

OptimizeResult optimize_mesh(const VolumeMesh& mesh, const TriangleMesh* target, const OptimizeOptions& options) {
  return MeshOptimizer(mesh, target, options).run(mesh);
}

}  // namespace subvol
