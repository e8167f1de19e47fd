// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/high_order_fit.h"

#include "subvol/base/error.h"
#include "subvol/base/format.h"
#include "subvol/base/option_checks.h"
#include "subvol/fit/elements/boundary_samples.h"
#include "subvol/fit/elements/ideal_boxes.h"
#include "subvol/fit/elements/quadrature.h"
#include "subvol/fit/energies/high_order_energy.h"
#include "subvol/fit/energies/make_surface_term.h"
#include "subvol/fit/fits/high_order_schedule.h"
#include "subvol/fit/fits/order_indicator.h"
#include "subvol/fit/geometry/boundary_triangles.h"
#include "subvol/fit/geometry/self_intersection.h"
#include "subvol/fit/quality/high_order_quality.h"
#include "subvol/fit/stages/memory_budget.h"
#include "subvol/fit/stages/stage_runner.h"
#include "subvol/fit/stages/staged_fit.h"
#include "subvol/fit/target/fit_target.h"
#include "subvol/fit/target/region_matching.h"
#include "subvol/mesh/interfaces.h"
#include "subvol/mesh/validate.h"
#include "subvol/surface/boundary.h"

#include <algorithm>
#include <cmath>
#include <new>
#include <stdexcept>
#include <tuple>
#include <utility>

namespace subvol {

using namespace internal;

namespace {

/// p-adaptivity: share of the total possible gain that one raise aims at, and the least gain, relative to E_S, that
/// justifies a raise.
constexpr double kRaisedShare = 0.7, kLeastOrderGain = 0.02;
/// A place is far if its distance exceeds kFarShare times the mean. At first, a place at kFirstFarLength times the mean
/// counts twice.
constexpr double kFarShare = 8, kFirstFarLength = 8;
constexpr int kMostDraws = 4, kDrawSteps = 20;
/// Emphasis on places of poor shape: its first value, doubled each time up to the last, until the least scaled Jacobian
/// is good.
constexpr double kFirstEmphasis = 4, kLastEmphasis = 512, kGoodScaledJacobian = 0.5;
constexpr int kLiftSteps = 8;
/// Emphases in a row that may fail to help before no stronger one is attempted.
constexpr int kMostFailedLifts = 3;
/// Largest number of rounds of both improvements, and the factor by which the distances may grow in total.
constexpr int kMostImprovements = 3;
constexpr double kMostDistanceGrowth = 1.2;

HighOrderFitOptions checked(const HighOrderFitOptions& options) {
  const auto in_range = [](const char* name, double value, double low, double high) {
    require_in_range("HighOrderFitOptions", name, value, low, high);
  };
  in_range("order", options.order, 1, kMaxOrder);
  in_range("lambda_close", options.lambda_close, 1e-9, 1e9);
  in_range("max_iterations", options.max_iterations, 0, 1e9);
  in_range("time_limit_seconds", options.time_limit_seconds, 0, 1e12);
  in_range("memory_limit_bytes", options.memory_limit_bytes, 0, 1e18);
  if (options.tolerance_percent) in_range("tolerance_percent", *options.tolerance_percent, 1e-9, 100);
  return options;
}

VolumeMesh checked_template(VolumeMesh mesh) {
  for (const MeshDefect& defect : validate(mesh))
    if (defect.kind != MeshDefect::Kind::unused_vertex) throw InputError("template mesh: " + defect.message);
  return mesh;
}

/// The high-order fit, in normalized coordinates.
class HighOrderFit : StagedFit {
 public:
  HighOrderFit(FitTarget target, const VolumeMesh& template_mesh, const HighOrderFitOptions& options);
  HighOrderFitResult run();

 private:
  /// The measures of a state when shape is weighed against distance.
  struct Outcome {
    double least_scaled_jacobian, mean_percent, max_percent;
    std::size_t pairs;  ///< number of intersecting triangle pairs
  };
  /// Outcome of a repeated stage; ended: it was interrupted.
  enum class Again { kept, undone, ended };

  void look_over_template();
  int sample_intervals(int order) const;
  bool has_room(const EntityOrders& orders);
  bool end_for_memory(const std::string& why);
  void set_orders(const EntityOrders& orders);
  std::unique_ptr<HighOrderEnergy> volume_energy(const ElementSpace& space) const;
  BoundarySamples sheet_samples(const ElementSpace& space) const;
  FitProblem problem(const ElementSpace& space, std::unique_ptr<HighOrderEnergy> volume, const BoundarySamples& samples,
                     const Stage& stage) const;
  bool run_stage(const Stage& stage);
  bool run_next_stage(const Stage& stage);
  bool run_final_stage(double lambda) override { return run_stage(schedule_.final_stage(lambda)); }
  void take_own_boxes();
  void begin_try(const HighOrderTry& attempt);
  bool run_order(Approach approach, int order);
  bool run_first_orders(int last);
  bool run_higher_orders();
  bool raise_where_it_pays();
  bool run_adaptive_orders();
  bool finish();
  void leave_folds();
  bool lower_lambda(std::size_t pairs);
  std::optional<Outcome> measured_outcome();
  bool improve_worst_places();
  bool is_better(const Outcome& next) const;
  Again run_again(double& setting, double value, int steps);
  Again draw_in_far_places();
  Again lift_worst_places();
  bool meets_tolerance();
  std::vector<Vec3> in_target_units(std::vector<Vec3> coefficients) const;
  TriangleMesh boundary(int intervals) const;
  TriangleMesh measured_boundary() const;
  std::optional<SurfaceDistance> measured_interfaces() const;
  double keep_mean(double distance);
  double measured_mean();
  std::optional<std::size_t> intersecting_pairs() override;
  std::optional<bool> is_folded();
  std::vector<Vec3>& unknowns() override { return mesh_.coefficients; }
  FitReport& report() override { return report_; }

  HighOrderFitOptions options_;
  FitTarget target_;
  VolumeMesh template_;
  HighOrderSchedule schedule_;
  std::vector<Vec3> ideal_boxes_;
  HighOrderMesh mesh_;
  BoundarySamples samples_;
  std::vector<Index> group_of_face_;  ///< `groups_of_sheets`; empty if there are no interfaces, or they are not kept
  int try_ = 0;              ///< number of the current attempt, from 1
  Approach approach_ = Approach::direct;
  int order_ = 1;            ///< highest order of any entity
  int order_in_progress_ = 0;  ///< the order whose part of the work has begun
  FitSnapshot start_{};      ///< state before the last stage of the schedule
  std::vector<int> points_;  ///< quadrature points of each cell per direction in the last stage
  bool stays_dense_ = false; ///< set after the first orders: cells keep at least points_
  double emphasis_ = 0;      ///< emphasis on places of poor shape in E_W
  double far_length_ = 0;    ///< distance at which places count twice in E_S; 0: all places count alike
  Outcome outcome_{};        ///< of the kept state, while the worst places are improved
  double most_mean_ = 0, most_max_ = 0;  ///< largest distances that this improvement may cause
  FitReport report_;
  MemoryBudget memory_;
  StageRunner runner_;
};

HighOrderFit::HighOrderFit(FitTarget target, const VolumeMesh& template_mesh, const HighOrderFitOptions& options)
    : StagedFit(options.keep_states),
      options_(checked(options)),
      target_(std::move(target)),
      template_(checked_template(template_mesh)),
      mesh_(ElementSpace(template_, options.basis, 1), template_),
      memory_(options.memory_limit_bytes, kMemoryOfNode),
      runner_({options.solver, options.max_iterations, options.time_limit_seconds, options.progress, options.cancelled,
               options.log}) {
  target_.normalisation.take_in(template_);
  mesh_.coefficients = template_.positions;
}

void HighOrderFit::look_over_template() {
  const StartComparison start =
      target_.compare_start(refined_triangles(boundary_surface(template_, MeshTopology(template_))));
  report_.note_start(start);
  schedule_ = make_high_order_schedule(options_.lambda_close, start.mean_distance / target_.surface.length());
  target_.keep_interfaces(template_);
  if (target_.has_interfaces())
    group_of_face_ = groups_of_sheets(template_, mesh_.space.topology());
  else if (region_references(template_).size() > 1)
    report_.warnings.push_back("points do not say where regions meet: their interfaces are not kept in place");
}

/// Returns the number of sample intervals along an edge: about as fine as the target, and fine enough for the curves'
/// chord errors to be negligible; fewer on surfaces of many faces, where chord errors matter less.
int HighOrderFit::sample_intervals(int order) const {
  constexpr int kMostIntervals = 16, kLeastPerOrder = 2, kWantedPerOrder = 4;
  constexpr double kMostTriangles = 60000;
  const double faces = static_cast<double>(mesh_.space.topology().boundary_faces().size());
  const double triangles = 2 * static_cast<double>(target_.surface.num_details());
  const int of_target = std::min(static_cast<int>(std::ceil(std::sqrt(triangles / faces))), kMostIntervals);
  const int affordable = static_cast<int>(std::sqrt(kMostTriangles / (2 * faces)));
  return std::max({of_target, kLeastPerOrder * order, std::min(kWantedPerOrder * order, affordable)});
}

/// Ends the fit in its current state. Throws std::runtime_error if nothing has been fitted yet.
bool HighOrderFit::end_for_memory(const std::string& why) {
  if (report_.stages.empty()) throw std::runtime_error("out of memory: " + why);
  report_.stop_reason = StopReason::memory_limit;
  report_.explanation = why;
  return false;
}

bool HighOrderFit::has_room(const EntityOrders& orders) {
  const std::size_t nodes = mesh_.space.with_orders(orders).num_nodes();
  return memory_.allows(nodes) || end_for_memory(memory_.refusal(formatted("a mesh of %zu nodes", nodes)));
}

void HighOrderFit::set_orders(const EntityOrders& orders) {
  for (FitState& state : states_)
    state.positions = HighOrderMesh(mesh_.space, std::move(state.positions)).with_orders(orders).coefficients;
  mesh_ = mesh_.with_orders(orders);
  order_ = mesh_.space.max_order();
  samples_ = sheet_samples(mesh_.space);
  target_.sample(samples_.points.size());
  mean_.reset();
}

/// Samples the boundary, and the interfaces if they are kept.
BoundarySamples HighOrderFit::sheet_samples(const ElementSpace& space) const {
  const int intervals = sample_intervals(space.max_order());
  return target_.has_interfaces() ? make_sheet_samples(space, template_, intervals)
                                  : make_boundary_samples(space, intervals);
}

std::unique_ptr<HighOrderEnergy> HighOrderFit::volume_energy(const ElementSpace& space) const {
  constexpr int kLeastPoints = 5;
  std::vector<int> points(space.num_cells());
  for (std::size_t c = 0; c < points.size(); ++c)
    points[c] = std::max({kLeastPoints, points_for_order(space.pattern_order(space.pattern(c))),
                          stays_dense_ ? points_[c] : 0});
  auto volume = std::make_unique<HighOrderEnergy>(space, ideal_boxes_, points);
  volume->set_distortion(options_.distortion);
  return volume;
}

/// Cell edges can stick out of the surface as fins, which are too thin to count if only points beside the edges are
/// used. So the edges themselves get points (`samples.at_edges`).
FitProblem HighOrderFit::problem(const ElementSpace& space, std::unique_ptr<HighOrderEnergy> volume,
                                 const BoundarySamples& samples, const Stage& stage) const {
  FitProblem problem(identity_map(samples.positions.num_cols), samples.positions, std::move(volume),
                     make_surface_term(target_.surface, samples.triangles, samples.points.size(),
                                       stage.tangential_weight, options_.correspondence, SurfacePull::straight,
                                       far_length_, samples.at_edges,
                                       {groups_of_triangles(samples.triangle_faces, group_of_face_),
                                        target_.group_of_triangle}),
                     stage.lambda);
  problem.tables.emplace(space, samples.points);
  return problem;
}

bool HighOrderFit::run_stage(const Stage& stage) {
  if (!report_.stages.empty() && !runner_.in_time(formatted("order %d", order_), report_)) return false;
  StageRecord record;
  const int least = std::ranges::min(mesh_.space.orders().cells);
  record.name = (try_ > 1 ? formatted("try %d, ", try_) : "") +
                (least < order_ ? formatted("orders %d to %d", least, order_) : formatted("order %d", order_)) +
                formatted(", lambda %g, tangential weight %g", stage.lambda, stage.tangential_weight);
  if (far_length_ > 0) record.name += formatted(", twice as heavy %.3g %% off", 100 * far_length_);
  if (emphasis_ > 0) record.name += formatted(", poor shape up to %g times as heavy", 1 + emphasis_);
  record.order = order_;
  record.cells = mesh_.space.num_cells();
  keep_state();
  lambda_ = stage.lambda;
  mean_.reset();
  std::unique_ptr<HighOrderEnergy> volume = volume_energy(mesh_.space);
  volume->emphasize_poor(mesh_.coefficients, emphasis_);
  const HighOrderEnergy& energy = *volume;
  FitProblem stage_problem = problem(mesh_.space, std::move(volume), samples_, stage);
  if (order_ != order_in_progress_) {
    constexpr double kExpectedSteps = 20;
    order_in_progress_ = order_;
    // An order takes about a quarter of the work of twice the order.
    const double share = std::pow(0.25, std::log2(static_cast<double>(options_.order) / order_));
    runner_.work().begin_part(share, kExpectedSteps);
  }
  const bool going = runner_.run(stage_problem, stage, std::move(record), mesh_.coefficients, report_);
  points_.assign(energy.points_per_direction().begin(), energy.points_per_direction().end());
  return going;
}

/// Runs a stage of the schedule and remembers the state before it.
bool HighOrderFit::run_next_stage(const Stage& stage) {
  start_ = snapshot();
  return run_stage(stage);
}

TriangleMesh HighOrderFit::boundary(int intervals) const {
  BoundarySamples fine = make_boundary_samples(mesh_.space, intervals);
  return {fine.positions.apply(mesh_.coefficients), std::move(fine.triangles)};
}

/// Returns the boundary, sampled more densely than for the fit.
TriangleMesh HighOrderFit::measured_boundary() const { return boundary(2 * sample_intervals(order_) + 1); }

std::optional<std::size_t> HighOrderFit::intersecting_pairs() {
  return runner_.intersecting_pairs(measured_boundary(), report_);
}

/// Returns true if the boundary intersects itself, apart from folds about as small as the gaps between samples. Returns
/// nothing if the fit must end.
std::optional<bool> HighOrderFit::is_folded() {
  const auto pairs = runner_.intersecting_pairs(boundary(sample_intervals(order_) + 1), report_);
  return pairs ? std::optional(*pairs > 0) : std::nullopt;
}

double HighOrderFit::keep_mean(double distance) {
  mean_ = 100 * distance;
  if (StageRecord* stage = report_.last_kept_stage()) stage->mean_distance_percent = *mean_;
  return *mean_;
}

double HighOrderFit::measured_mean() {
  if (mean_) return *mean_;
  double mean = target_.mean_distance(measured_boundary());
  if (const auto inner = measured_interfaces()) mean = std::max(mean, inner->mean());
  return keep_mean(mean);
}

/// Measures the interfaces if the target has them, too; those that keep their shape do not count.
std::optional<SurfaceDistance> HighOrderFit::measured_interfaces() const {
  if (target_.region_triangle.empty()) return std::nullopt;
  const std::vector<Index> faces = find_interfaces(template_, mesh_.space.topology()).faces;
  const BoundarySamples fine = make_face_samples(mesh_.space, faces, 2 * sample_intervals(order_) + 1);
  return target_.interface_distance({fine.positions.apply(mesh_.coefficients), fine.triangles},
                                    groups_of_triangles(fine.triangle_faces, group_of_face_));
}

bool HighOrderFit::meets_tolerance() {
  return options_.tolerance_percent && measured_mean() <= *options_.tolerance_percent;
}

/// From now on, the ideal cells are boxes of the cells' present sizes: graded meshes stay graded.
void HighOrderFit::take_own_boxes() {
  ideal_boxes_ = ideal_boxes(template_, std::span(mesh_.coefficients).first(template_.num_vertices()),
                             target_.surface.volume(), 1);
}

void HighOrderFit::begin_try(const HighOrderTry& attempt) {
  ++try_;
  approach_ = attempt.approach;
  states_.clear();
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

/// Runs the orders up to `last` with the first attempt that gets near the target without folding its surface, or else
/// with the best attempt: unfolded before folded, then by the least energy.
bool HighOrderFit::run_first_orders(int last) {
  struct Arrival {
    bool folded;
    double mean, distortion, energy;
    HighOrderMesh mesh;
    std::vector<Vec3> ideal_boxes;
    std::vector<int> points;
    Approach approach;
    std::vector<FitState> states;
    FitSnapshot start;
    int number;  ///< number of the attempt
    std::size_t stages_begin, stages_end;  ///< in the report
  };
  std::optional<Arrival> best;
  const std::size_t stages_before = report_.stages.size();
  const auto take_best = [&] {  // allocates nothing
    mesh_ = std::move(best->mesh);
    ideal_boxes_ = std::move(best->ideal_boxes);
    points_ = std::move(best->points);
    approach_ = best->approach;
    states_ = std::move(best->states);
    start_ = std::move(best->start);
    try_ = best->number;
    report_.undo_stages(stages_before, best->stages_begin);
    report_.undo_stages(best->stages_end, report_.stages.size());
  };
  // True if folded; nothing if the fit must end.
  const auto arrive = [&](const HighOrderTry& attempt) -> std::optional<bool> {
    begin_try(attempt);
    for (int order = 1; order <= last; order = order == last ? last + 1 : std::min(2 * order, last))
      if (!run_order(attempt.approach, order)) return {};
    return schedule_.tries.size() == 1 ? false : is_folded();
  };
  for (const HighOrderTry& attempt : schedule_.tries) {
    const std::size_t stages_begin = report_.stages.size();
    std::optional<bool> folded;
    try {
      folded = arrive(attempt);
    } catch (const std::bad_alloc&) {
      if (best) take_best();
      throw;
    }
    if (!folded) {
      if (best) take_best();
      return false;
    }
    if (schedule_.tries.size() == 1) return true;
    const auto& steps = report_.stages.back().iterations;
    const double distortion = steps.empty() ? 0 : steps.back().volume_energy;
    const double energy = steps.empty() ? 0 : steps.back().surface_energy + lambda_ * distortion;
    Arrival arrival{*folded, measured_mean(), distortion, energy, mesh_, ideal_boxes_, points_, approach_,
                    states_, start_, try_, stages_begin, report_.stages.size()};
    const bool better =
        !best || std::tuple(arrival.folded, arrival.energy) < std::tuple(best->folded, best->energy);
    if (better) best = std::move(arrival);
    const bool fair = last < kTellingOrder || best->mean <= kFairDistancePercent || best->distortion <= kFairDistortion;
    if (!best->folded && fair) break;
  }
  take_best();
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
  if (!(gains.sum() > kLeastOrderGain * surface)) return false;
  set_orders(raised_where_it_pays(mesh_.space, next, gains, kRaisedShare));
  return true;
}

/// Raises orders as long as it pays and the tolerance is not met. The rest is left to `lower_lambda`.
bool HighOrderFit::run_adaptive_orders() {
  stays_dense_ = true;
  while (!meets_tolerance() && raise_where_it_pays()) {
    take_own_boxes();
    if (!run_next_stage(schedule_.final_stage(options_.lambda_close))) return false;
  }
  return report_.stop_reason != StopReason::memory_limit;
}

/// Repeats the last stage with less and less weight on the cells' shape until the tolerance is met; without a
/// tolerance, only undoes the rise of lambda by unfolding. A stage that is interrupted or leaves more than `pairs`
/// self-intersections is rolled back.
bool HighOrderFit::lower_lambda(std::size_t pairs) {
  const double least = (options_.tolerance_percent ? 1e-3 : 1) * options_.lambda_close;
  for (double lambda = lambda_ / 2; !meets_tolerance() && lambda >= 0.99 * least; lambda /= 2) {
    const double before = measured_mean();
    FitSnapshot stiffer = snapshot();
    const std::optional<std::size_t> pairs_now =
        or_back(stiffer, [&] { return run_final_stage(lambda) ? intersecting_pairs() : std::nullopt; });
    if (!pairs_now || *pairs_now > pairs) {
      go_back(std::move(stiffer));
      return pairs_now.has_value();
    }
    pairs = *pairs_now;
    if (1 - measured_mean() / before < kLeastGain) break;
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
  emphasis_ = far_length_ = 0;
  if (!unfold(start_, kMostUnfoldingLambdaOfOrders, *pairs)) return false;
  return *pairs == pairs_before || (lower_lambda(*pairs) && improve_worst_places());
}

/// If the boundary of a fit that had to end early intersects itself, and less so before the last stage of the schedule,
/// rolls back to that state. This takes two searches for self-intersections beyond the time limit, so a fit that was
/// cancelled is left as it is.
void HighOrderFit::leave_folds() {
  if (report_.stop_reason == StopReason::cancelled) return;
  const auto pairs = [&] { return self_intersections(measured_boundary()).pairs.size(); };
  if (start_.x.size() != mesh_.coefficients.size()) return;  // the last order's stage has not begun
  const std::size_t pairs_now = pairs();
  if (pairs_now == 0) return;
  start_.x.swap(mesh_.coefficients);
  const std::size_t pairs_before = pairs();
  start_.x.swap(mesh_.coefficients);
  if (pairs_before >= pairs_now) return;
  go_back(std::move(start_));
  report_.explanation += formatted(
      "; %zu pairs of triangles of the boundary intersected then, %zu of them before, so "
      "the state before was taken",
      pairs_now, pairs_before);
}

/// Measures the state; returns nothing if the fit must end.
std::optional<HighOrderFit::Outcome> HighOrderFit::measured_outcome() {
  const QualityReport quality = measure_quality(mesh_);
  const SurfaceDistance distance = target_.distance(measured_boundary());
  const std::optional<SurfaceDistance> inner = measured_interfaces();
  const double mean = keep_mean(inner ? std::max(distance.mean(), inner->mean()) : distance.mean());
  const double largest = inner ? std::max(distance.max(), inner->max()) : distance.max();
  const std::optional<std::size_t> pairs = intersecting_pairs();
  if (!pairs) return {};
  return Outcome{quality.min_scaled_jacobian, mean, 100 * largest, *pairs};
}

/// Repeats the last stage to improve a few places that hardly count in the energies, since these are means.
bool HighOrderFit::improve_worst_places() {
  if (!options_.improve_worst_places || options_.order < 2) return true;
  const std::optional<Outcome> first = measured_outcome();
  if (!first) return false;
  outcome_ = *first;
  most_max_ = kMostDistanceGrowth * outcome_.max_percent;
  most_mean_ = options_.tolerance_percent ? std::max(outcome_.mean_percent, *options_.tolerance_percent)
                                          : kMostDistanceGrowth * outcome_.mean_percent;
  for (int round = 0; round < kMostImprovements; ++round) {
    const double far_length_before = far_length_;
    if (draw_in_far_places() == Again::ended) return false;
    if (round > 0 && far_length_ == far_length_before) break;  // the same lifts would fail again
    const double emphasis_before = emphasis_;
    if (lift_worst_places() == Again::ended) return false;
    if (emphasis_ == emphasis_before) break;  // otherwise, cells may now tolerate what they could not before
  }
  return true;
}

/// Returns true if the state is within the limits and better by the least scaled Jacobian (capped if good), divided by
/// the mean and by the largest distance.
bool HighOrderFit::is_better(const Outcome& next) const {
  const auto shape = [](const Outcome& x) { return std::min(x.least_scaled_jacobian, kGoodScaledJacobian); };
  const double gain = outcome_.mean_percent / next.mean_percent * (outcome_.max_percent / next.max_percent);
  return shape(next) > 0 && gain * shape(next) > shape(outcome_) && next.mean_percent <= most_mean_ &&
         next.max_percent <= most_max_ && next.pairs <= outcome_.pairs;
}

/// Repeats the last stage with one setting changed; if the result is not better, rolls back the stage and the setting.
HighOrderFit::Again HighOrderFit::run_again(double& setting, double value, int steps) {
  FitSnapshot before = snapshot();
  const double setting_before = std::exchange(setting, value);
  Stage stage = schedule_.final_stage(lambda_);
  stage.max_iterations = steps;
  const std::optional<Outcome> next =
      or_back(before, [&] { return run_stage(stage) ? measured_outcome() : std::nullopt; });
  if (next && is_better(*next)) {
    outcome_ = *next;
    return Again::kept;
  }
  go_back(std::move(before));
  setting = setting_before;
  return next ? Again::undone : Again::ended;
}

/// Puts more and more emphasis on places much farther off than the mean, as long as there are any.
HighOrderFit::Again HighOrderFit::draw_in_far_places() {
  Again last = Again::kept;
  if (options_.correspondence != Correspondence::closest) return last;
  for (int draw = 0; draw < kMostDraws && last == Again::kept; ++draw) {
    if (!(outcome_.max_percent > kFarShare * outcome_.mean_percent)) break;
    const double first = kFirstFarLength * outcome_.mean_percent / 100;
    last = run_again(far_length_, far_length_ == 0 ? first : far_length_ / 2, kDrawSteps);
  }
  return last;
}

/// Puts more and more emphasis on places of poor shape, as long as there are any. An emphasis that does not help may be
/// too weak to change the worst cell, so stronger ones are attempted as well before this ends.
HighOrderFit::Again HighOrderFit::lift_worst_places() {
  const auto is_poor = [&] {
    return outcome_.least_scaled_jacobian > 0 && outcome_.least_scaled_jacobian < kGoodScaledJacobian;
  };
  double attempted = emphasis_;
  for (int failures = 0; failures < kMostFailedLifts && is_poor() && attempted < kLastEmphasis;) {
    attempted = attempted == 0 ? kFirstEmphasis : 2 * attempted;
    const Again last = run_again(emphasis_, attempted, kLiftSteps);
    if (last == Again::ended) return last;
    failures = last == Again::kept ? 0 : failures + 1;
  }
  return Again::kept;
}

std::vector<Vec3> HighOrderFit::in_target_units(std::vector<Vec3> coefficients) const {
  const std::size_t num_vertices = mesh_.space.num_vertices();
  for (std::size_t i = 0; i < coefficients.size(); ++i)
    coefficients[i] = target_.normalisation.diagonal * coefficients[i] +
                      (i < num_vertices ? target_.normalisation.centre : Vec3(0, 0, 0));
  return coefficients;
}

HighOrderFitResult HighOrderFit::run() {
  look_over_template();
  const int first = std::min(schedule_.first_orders(options_.adaptive), options_.order);
  try {
    if (run_first_orders(first) && (options_.adaptive ? run_adaptive_orders() : run_higher_orders()) && finish())
      runner_.conclude(measured_mean(), options_.tolerance_percent, report_);
    else
      leave_folds();
  } catch (const std::bad_alloc&) {
    end_for_memory(formatted("no memory was left at order %d", order_));
  }
  report_.seconds = {{"total", runner_.seconds()}};
  mesh_.coefficients = in_target_units(std::move(mesh_.coefficients));
  for (FitState& state : states_) state.positions = in_target_units(std::move(state.positions));
  return {std::move(mesh_), std::move(report_), std::move(states_)};
}

}  // namespace

HighOrderFitResult fit_high_order(const TriangleMesh& target, const VolumeMesh& template_mesh,
                                  const HighOrderFitOptions& options) {
  if (const std::optional<RegionSurface> regions = regions_as_in(target, template_mesh))
    return HighOrderFit(FitTarget(*regions), template_mesh, options).run();
  return HighOrderFit(FitTarget(target), template_mesh, options).run();
}

HighOrderFitResult fit_high_order(const PointCloud& target, const VolumeMesh& template_mesh,
                                  const HighOrderFitOptions& options) {
  require_closest(options.correspondence);
  return HighOrderFit(FitTarget(target, options.point_weights), template_mesh, options).run();
}

}  // namespace subvol
