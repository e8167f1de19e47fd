// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/high_order_driver.h"

#include "subvol/base/format.h"
#include "subvol/base/option_checks.h"
#include "subvol/fit/elements/ideal_boxes.h"
#include "subvol/fit/elements/quadrature.h"
#include "subvol/fit/energies/make_surface_term.h"
#include "subvol/fit/fits/cell_lift.h"
#include "subvol/fit/geometry/boundary_triangles.h"
#include "subvol/fit/high_order_patch.h"
#include "subvol/fit/quality/high_order_quality.h"
#include "subvol/fit/quality/region_quality.h"
#include "subvol/fit/stages/quality_patches.h"
#include "subvol/fit/stages/solve_control.h"
#include "subvol/mesh/interfaces.h"
#include "subvol/mesh/pyramids.h"
#include "subvol/mesh/validate.h"
#include "subvol/surface/boundary.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <map>
#include <stdexcept>
#include <utility>

namespace subvol::internal {

namespace {

HighOrderFitOptions checked(const HighOrderFitOptions& options) {
  const auto in_range = [](const char* name, double value, double low, double high) {
    require_in_range("HighOrderFitOptions", name, value, low, high);
  };
  in_range("order", options.order, 1, kMaxOrder);
  if (options.lambda_close) in_range("lambda_close", *options.lambda_close, 1e-9, 1e9);
  if (options.crease_angle_degrees) in_range("crease_angle_degrees", *options.crease_angle_degrees, 0, 180);
  check_control("HighOrderFitOptions", options.control);
  in_range("memory_limit_bytes", options.memory_limit_bytes, 0, 1e18);
  in_range("quality", options.quality, 0, kMostQuality);
  if (options.tolerance_percent) in_range("tolerance_percent", *options.tolerance_percent, 1e-9, 100);
  return options;
}

VolumeMesh checked_template(VolumeMesh mesh) {
  require_valid(mesh, "template mesh");
  require_no_pyramids(mesh.kinds, "template mesh: pyramids cannot be curved");
  return mesh;
}

}  // namespace

HighOrderDriver::HighOrderDriver(FitTarget target, const VolumeMesh& template_mesh, const HighOrderFitOptions& options)
    : StagedFit(options.keep_states),
      options_(checked(options)),
      target_(std::move(target)),
      template_(checked_template(template_mesh)),
      mesh_(ElementSpace(template_, options.basis, 1), template_),
      memory_(options.memory_limit_bytes, kMemoryOfNode),
      runner_(options.control, options.solver, options.tuning) {
  target_.normalization.take_in(template_);
  mesh_.coefficients = template_.positions;
  creases_ = creases_along_target(target_, crease_rule(), template_);
}

void HighOrderDriver::look_over_template() {
  const StartComparison start = target_.compare_start(
      order_ > 1 ? measured_boundary() : refined_triangles(boundary_surface(template_, MeshTopology(template_))));
  report_.note_start(start);
  const bool follows_nearly_all = creases_.followed_share() >= tuning().nearly_all_edges;
  const double usual_lambda = follows_nearly_all ? kCurvingLambda : kLambdaOfOrders;
  schedule_ = make_high_order_schedule(options_.lambda_close.value_or(usual_lambda),
                                       start.mean_distance / target_.surface.length(), options_.tuning);
  keep_interfaces(crease_rule(), target_, creases_, template_, report_);
  if (target_.has_interfaces()) group_of_face_ = groups_of_sheets(template_, mesh_.space.topology());
}

/// Returns the number of sample intervals along an edge: about as fine as the target, and fine enough for the curves'
/// chord errors to be negligible; fewer on surfaces of many faces, where chord errors matter less.
int HighOrderDriver::sample_intervals(int order) const {
  const double faces = static_cast<double>(mesh_.space.topology().boundary_faces().size());
  const double triangles = 2 * static_cast<double>(target_.surface.num_details());
  const int of_target = std::min(static_cast<int>(std::ceil(std::sqrt(triangles / faces))), tuning().most_intervals);
  const int affordable = static_cast<int>(std::sqrt(tuning().most_fitted_triangles / (2 * faces)));
  return std::max({of_target, tuning().least_intervals_per_order * order,
                   std::min(tuning().wanted_intervals_per_order * order, affordable)});
}

/// Returns the number of intervals for measuring: more than for the fit, up to about twice as many, if there are not
/// too many triangles.
int HighOrderDriver::measured_intervals() const {
  constexpr double kMostMeasuredTriangles = 1e6;  // of all faces together, to bound the time of distances
  const double faces = static_cast<double>(mesh_.space.topology().boundary_faces().size());
  const int own = sample_intervals(order_);
  return std::max(own + 1, std::min(2 * own + 1, static_cast<int>(std::sqrt(kMostMeasuredTriangles / (2 * faces)))));
}

bool HighOrderDriver::end_for_memory(const std::string& why) {
  if (report_.stages.empty()) throw std::runtime_error("out of memory: " + why);
  report_.stop_reason = StopReason::memory_limit;
  report_.explanation = why;
  return false;
}

bool HighOrderDriver::has_room(const EntityOrders& orders) {
  const std::size_t nodes = mesh_.space.with_orders(orders).num_nodes();
  return memory_.allows(nodes) || end_for_memory(memory_.refusal(formatted("a mesh of %zu nodes", nodes)));
}

void HighOrderDriver::set_orders(const EntityOrders& orders) {
  for (FitState& state : states_)
    state.positions = HighOrderMesh(mesh_.space, std::move(state.positions)).with_orders(orders).coefficients;
  for (FitSnapshot& start : starts_)
    start.x = HighOrderMesh(mesh_.space, std::move(start.x)).with_orders(orders).coefficients;
  mesh_ = mesh_.with_orders(orders);
  order_ = mesh_.space.max_order();
  samples_ = sheet_samples(mesh_.space);
  target_.sample(samples_.points.size(), static_cast<std::size_t>(options_.tuning.fitting.least_target_samples));
  mean_.reset();
}

/// Samples the boundary, and the interfaces if they are kept, with the creases that follow curves.
BoundarySamples HighOrderDriver::sheet_samples(const ElementSpace& space) const {
  const int intervals = sample_intervals(space.max_order());
  std::span<const CreaseEdge> creases;
  if (!creases_.curves().empty()) creases = template_.tags.creases;
  return target_.has_interfaces() ? make_sheet_samples(space, template_, intervals, creases)
                                  : make_boundary_samples(space, intervals, creases);
}

std::unique_ptr<HighOrderEnergy> HighOrderDriver::volume_energy(const ElementSpace& space,
                                                                std::span<const Index> cells) const {
  std::vector<int> points(space.num_cells());
  std::vector<Vec3> boxes(space.num_cells());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::size_t c = cells.empty() ? i : static_cast<std::size_t>(cells[i]);
    points[i] = std::max({kLeastDistortionPoints, points_for_order(space.pattern_order(space.pattern(i))),
                          stays_dense_ ? points_[c] : 0});
    boxes[i] = ideal_boxes_[c];
  }
  auto volume = std::make_unique<HighOrderEnergy>(space, boxes, points);
  volume->set_tuning(options_.tuning.curved);
  volume->count_as_part(template_.num_cells());
  volume->set_distortion(options_.distortion);
  volume->set_hinge(hinge_, std::min(1.0, options_.quality + tuning().hinge_above_quality));
  return volume;
}

/// Cell edges can stick out of the surface as fins, which are too thin to count if only points beside the edges are
/// used. So the edges themselves get points (`samples.at_edges`).
std::unique_ptr<SurfaceTerm> HighOrderDriver::surface_energy(const BoundarySamples& samples,
                                                             double tangential_weight) const {
  std::unique_ptr<SurfaceTerm> term =
      make_surface_term(target_.surface, samples.triangles, samples.points.size(), tangential_weight,
                        options_.correspondence, SurfacePull::straight, far_length_, samples.at_edges,
                        {groups_of_triangles(samples.triangle_faces, group_of_face_), target_.group_of_triangle});
  if (!creases_.curves().empty())
    term->add_creases(creases_.energy(samples.crease_edges, samples.points.size(),
                                      kCreaseWidth * target_.surface.length(), tangential_weight));
  return term;
}

FitProblem HighOrderDriver::problem(const ElementSpace& space, std::unique_ptr<HighOrderEnergy> volume,
                                    const BoundarySamples& samples, const Stage& stage) const {
  FitProblem problem(identity_map(samples.positions.num_cols), samples.positions, std::move(volume),
                     surface_energy(samples, stage.tangential_weight), stage.lambda);
  problem.tables.emplace(space, samples.points);
  return problem;
}

StageRecord HighOrderDriver::new_record(const Stage& stage) const {
  StageRecord record;
  const int least = std::ranges::min(mesh_.space.orders().cells);
  record.name = (try_ > 1 ? formatted("try %d, ", try_) : "") +
                (least < order_ ? formatted("orders %d to %d", least, order_) : formatted("order %d", order_)) +
                formatted(", lambda %g, tangential weight %g", stage.lambda, stage.tangential_weight);
  if (far_length_ > 0) record.name += formatted(", twice as heavy %.3g %% off", 100 * far_length_);
  if (hinge_ > 0) record.name += formatted(", hinge of weight %g", hinge_);
  if (emphasis_ > 0) record.name += formatted(", poor shape up to %g times as heavy", 1 + emphasis_);
  record.order = order_;
  record.cells = mesh_.space.num_cells();
  return record;
}

void HighOrderDriver::begin_stage(const Stage& stage) {
  keep_state();
  lambda_ = stage.lambda;
  mean_.reset();
  if (order_ == order_in_progress_) return;
  constexpr double kExpectedOrderSteps = 20;  // for the progress
  order_in_progress_ = order_;
  // An order takes about a quarter of the work of twice the order.
  const double share = std::pow(0.25, std::log2(static_cast<double>(options_.order) / order_));
  runner_.work().begin_part(share, kExpectedOrderSteps);
}

bool HighOrderDriver::run_stage(const Stage& stage) {
  if (!report_.stages.empty() && !runner_.in_time(formatted("order %d", order_), report_)) return false;
  begin_stage(stage);
  moved_cells_.clear();
  std::unique_ptr<HighOrderEnergy> volume = volume_energy(mesh_.space);
  volume->emphasize_poor(mesh_.coefficients, emphasis_);
  const HighOrderEnergy& energy = *volume;
  FitProblem stage_problem = problem(mesh_.space, std::move(volume), samples_, stage);
  const bool going = runner_.run(stage_problem, stage, new_record(stage), mesh_.coefficients, report_);
  points_.assign(energy.points_per_direction().begin(), energy.points_per_direction().end());
  return going;
}

/// The patch is a part of the problem of `run_stage`, with the same weights.
bool HighOrderDriver::run_stage_around(std::span<const Index> cells, const Stage& stage) {
  const auto cells_of_template = static_cast<double>(template_.num_cells());
  const auto most = static_cast<std::size_t>(options_.tuning.quality.most_patch_share * cells_of_template);
  std::optional<HighOrderPatch> patch;
  if (options_.correspondence == Correspondence::closest)
    for (std::size_t count = cells.size(); count > 0 && !patch; count /= 2) {
      patch = high_order_patch(template_, mesh_.space, cells.first(count), kHighOrderRings, most);
      if (template_.num_cells() <= static_cast<std::size_t>(tuning().most_moved_as_whole)) break;
    }
  if (!patch) return run_stage(stage);
  if (!runner_.in_time(formatted("order %d", order_), report_)) return false;
  begin_stage(stage);
  std::unique_ptr<HighOrderEnergy> volume = volume_energy(patch->space, patch->cells);
  volume->emphasize_poor(patch->coefficients(mesh_.coefficients), emphasis_);
  const HighOrderEnergy& energy = *volume;
  const std::unique_ptr<ClosestPointEnergy> surface = closest_point_energy(stage.tangential_weight);
  surface->assign_target(samples_.positions.apply(mesh_.coefficients));
  FitProblem part = patch_problem(*patch, mesh_.coefficients, std::move(volume), samples_, *surface, stage.lambda);
  StageRecord record = new_record(stage);
  record.name += formatted(", %zu cells", patch->cells.size());
  std::vector<Vec3> x;
  for (const Index node : patch->unknowns) x.push_back(mesh_.coefficients[node]);
  const double step_work = static_cast<double>(patch->cells.size()) / static_cast<double>(template_.num_cells());
  const bool going = runner_.run(part, stage, std::move(record), x, report_, step_work);
  for (std::size_t i = 0; i < x.size(); ++i) mesh_.coefficients[patch->unknowns[i]] = x[i];
  for (std::size_t i = 0; i < patch->cells.size(); ++i) points_[patch->cells[i]] = energy.points_per_direction()[i];
  moved_cells_ = std::move(patch->cells);
  return going;
}

bool HighOrderDriver::run_next_stage(const Stage& stage) {
  starts_.push_back(snapshot());
  return run_stage(stage);
}

TriangleMesh HighOrderDriver::surface_at(const BoundarySamples& samples) const {
  return {samples.positions.apply(mesh_.coefficients), samples.triangles};
}

TriangleMesh HighOrderDriver::boundary(int intervals) const {
  return surface_at(make_boundary_samples(mesh_.space, intervals));
}

/// Returns the boundary, sampled more densely than for the fit.
TriangleMesh HighOrderDriver::measured_boundary() const { return boundary(measured_intervals()); }

std::optional<std::size_t> HighOrderDriver::intersecting_pairs() {
  return runner_.intersecting_pairs(measured_boundary(), report_);
}

/// Returns true if the boundary intersects itself, apart from folds about as small as the gaps between samples. Returns
/// nothing if the fit must end.
std::optional<bool> HighOrderDriver::is_folded() {
  const auto pairs = runner_.intersecting_pairs(boundary(sample_intervals(order_) + 1), report_);
  return pairs ? std::optional(*pairs > 0) : std::nullopt;
}

double HighOrderDriver::keep_mean(double distance) {
  mean_ = 100 * distance;
  if (StageRecord* stage = report_.last_kept_stage()) stage->mean_distance_percent = *mean_;
  return *mean_;
}

double HighOrderDriver::measured_mean() {
  if (mean_) return *mean_;
  double mean = target_.mean_distance(measured_boundary());
  if (const auto inner = measured_interfaces()) mean = std::max(mean, inner->mean());
  return keep_mean(mean);
}

/// Measures the interfaces if the target has them, too; those that keep their shape do not count.
std::optional<SurfaceDistance> HighOrderDriver::measured_interfaces() const {
  if (target_.region_triangle.empty()) return std::nullopt;
  const std::vector<Index> faces = find_interfaces(template_, mesh_.space.topology()).faces;
  const BoundarySamples fine = make_face_samples(mesh_.space, faces, measured_intervals());
  return target_.interface_distance(surface_at(fine), groups_of_triangles(fine.triangle_faces, group_of_face_));
}

std::optional<CreaseDistance> HighOrderDriver::measured_creases() const {
  if (creases_.curves().empty()) return {};
  const EdgeSamples samples = make_edge_samples(mesh_.space, template_.tags.creases, measured_intervals());
  return creases_.distance(samples.segments, samples.positions.apply(mesh_.coefficients), 1);
}

bool HighOrderDriver::meets_tolerance() {
  return options_.tolerance_percent && measured_mean() <= *options_.tolerance_percent;
}

double HighOrderDriver::volume_percent() const {
  if (target_.region_volumes.empty()) return 0;
  double largest = 0;
  const RegionReport found = measure_regions(mesh_, {template_.references, {}}, nullptr);
  for (std::size_t r = 0; r < found.regions.size(); ++r)
    largest = std::max(largest, 100 * std::abs(found.regions[r].volume / target_.region_volumes[r] - 1));
  return largest;
}

void HighOrderDriver::take_own_boxes() {
  ideal_boxes_ = ideal_boxes(template_, std::span(mesh_.coefficients).first(template_.num_vertices()),
                             target_.surface.volume(), 1);
}

std::optional<HighOrderDriver::Outcome> HighOrderDriver::measured_outcome(bool moved_only) {
  QualityReport quality = measure_quality(mesh_);
  const BoundarySamples fine = make_boundary_samples(mesh_.space, measured_intervals());
  const TriangleMesh surface = surface_at(fine);
  const SurfaceDistance distance = target_.distance(surface);
  const std::optional<SurfaceDistance> inner = measured_interfaces();
  const double mean = keep_mean(inner ? std::max(distance.mean(), inner->mean()) : distance.mean());
  double max_percent = 100 * (inner ? std::max(distance.max(), inner->max()) : distance.max());
  if (const auto creases = measured_creases()) max_percent = std::max(max_percent, creases->max_percent());
  std::vector<std::uint8_t> moved;
  if (moved_only && !moved_cells_.empty())
    for (const Index face : fine.triangle_faces)
      moved.push_back(std::ranges::binary_search(moved_cells_, mesh_.space.topology().face_cells(face)[0]));
  const std::optional<std::size_t> pairs = runner_.intersecting_pairs(surface, report_, moved);
  if (!pairs) return {};
  return Outcome{
      std::move(quality.cell_minima), quality.min_scaled_jacobian, mean, max_percent, *pairs, volume_percent()};
}

/// Returns E_S, whose correspondences must be closest points.
std::unique_ptr<ClosestPointEnergy> HighOrderDriver::closest_point_energy(double tangential_weight) const {
  std::unique_ptr<SurfaceTerm> surface = surface_energy(samples_, tangential_weight);
  return std::unique_ptr<ClosestPointEnergy>(&dynamic_cast<ClosestPointEnergy&>(*surface.release()));
}

std::vector<Index> HighOrderDriver::far_cells(double percent) const {
  const std::unique_ptr<ClosestPointEnergy> surface = closest_point_energy(0);
  surface->assign(samples_.positions.apply(mesh_.coefficients));
  const std::vector<double> distances = surface->triangle_distances();
  std::map<Index, double> farthest;
  for (std::size_t t = 0; t < distances.size(); ++t) {
    if (!(100 * distances[t] > percent)) continue;
    double& distance = farthest[mesh_.space.topology().face_cells(samples_.triangle_faces[t])[0]];
    distance = std::max(distance, distances[t]);
  }
  std::vector<Index> cells;
  for (const auto& [cell, distance] : farthest) cells.push_back(cell);
  std::ranges::stable_sort(cells, std::greater{}, [&](Index c) { return farthest.at(c); });
  return cells;
}

std::vector<Vec3> HighOrderDriver::in_target_units(std::vector<Vec3> coefficients) const {
  const auto& [center, diagonal] = target_.normalization;
  return moved(std::move(coefficients), mesh_.space.num_vertices(), diagonal, center);
}

HighOrderMesh HighOrderDriver::in_unit(HighOrderMesh mesh) const {
  const auto& [center, diagonal] = target_.normalization;
  mesh.coefficients = moved(std::move(mesh.coefficients), mesh.space.num_vertices(), 1 / diagonal, -center / diagonal);
  return mesh;
}

}  // namespace subvol::internal
