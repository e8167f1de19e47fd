// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/high_order_driver.h"

#include "subvol/base/error.h"
#include "subvol/base/format.h"
#include "subvol/base/option_checks.h"
#include "subvol/fit/elements/ideal_boxes.h"
#include "subvol/fit/elements/quadrature.h"
#include "subvol/fit/energies/make_surface_term.h"
#include "subvol/fit/geometry/boundary_triangles.h"
#include "subvol/fit/quality/high_order_quality.h"
#include "subvol/mesh/interfaces.h"
#include "subvol/mesh/validate.h"
#include "subvol/surface/boundary.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace subvol::internal {

namespace {

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

}  // namespace

HighOrderDriver::HighOrderDriver(FitTarget target, const VolumeMesh& template_mesh, const HighOrderFitOptions& options)
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

void HighOrderDriver::look_over_template() {
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
int HighOrderDriver::sample_intervals(int order) const {
  constexpr int kMostIntervals = 16, kLeastPerOrder = 2, kWantedPerOrder = 4;
  constexpr double kMostTriangles = 60000;
  const double faces = static_cast<double>(mesh_.space.topology().boundary_faces().size());
  const double triangles = 2 * static_cast<double>(target_.surface.num_details());
  const int of_target = std::min(static_cast<int>(std::ceil(std::sqrt(triangles / faces))), kMostIntervals);
  const int affordable = static_cast<int>(std::sqrt(kMostTriangles / (2 * faces)));
  return std::max({of_target, kLeastPerOrder * order, std::min(kWantedPerOrder * order, affordable)});
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
  target_.sample(samples_.points.size());
  mean_.reset();
}

/// Samples the boundary, and the interfaces if they are kept.
BoundarySamples HighOrderDriver::sheet_samples(const ElementSpace& space) const {
  const int intervals = sample_intervals(space.max_order());
  return target_.has_interfaces() ? make_sheet_samples(space, template_, intervals)
                                  : make_boundary_samples(space, intervals);
}

std::unique_ptr<HighOrderEnergy> HighOrderDriver::volume_energy(const ElementSpace& space) const {
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
FitProblem HighOrderDriver::problem(const ElementSpace& space, std::unique_ptr<HighOrderEnergy> volume,
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

bool HighOrderDriver::run_stage(const Stage& stage) {
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

bool HighOrderDriver::run_next_stage(const Stage& stage) {
  starts_.push_back(snapshot());
  return run_stage(stage);
}

TriangleMesh HighOrderDriver::boundary(int intervals) const {
  BoundarySamples fine = make_boundary_samples(mesh_.space, intervals);
  return {fine.positions.apply(mesh_.coefficients), std::move(fine.triangles)};
}

/// Returns the boundary, sampled more densely than for the fit.
TriangleMesh HighOrderDriver::measured_boundary() const { return boundary(2 * sample_intervals(order_) + 1); }

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
  const BoundarySamples fine = make_face_samples(mesh_.space, faces, 2 * sample_intervals(order_) + 1);
  return target_.interface_distance({fine.positions.apply(mesh_.coefficients), fine.triangles},
                                    groups_of_triangles(fine.triangle_faces, group_of_face_));
}

bool HighOrderDriver::meets_tolerance() {
  return options_.tolerance_percent && measured_mean() <= *options_.tolerance_percent;
}

void HighOrderDriver::take_own_boxes() {
  ideal_boxes_ = ideal_boxes(template_, std::span(mesh_.coefficients).first(template_.num_vertices()),
                             target_.surface.volume(), 1);
}

/// Measures the state; returns nothing if the fit must end.
std::optional<HighOrderDriver::Outcome> HighOrderDriver::measured_outcome() {
  const QualityReport quality = measure_quality(mesh_);
  const SurfaceDistance distance = target_.distance(measured_boundary());
  const std::optional<SurfaceDistance> inner = measured_interfaces();
  const double mean = keep_mean(inner ? std::max(distance.mean(), inner->mean()) : distance.mean());
  const double largest = inner ? std::max(distance.max(), inner->max()) : distance.max();
  const std::optional<std::size_t> pairs = intersecting_pairs();
  if (!pairs) return {};
  return Outcome{quality.min_scaled_jacobian, mean, 100 * largest, *pairs};
}

std::vector<Vec3> HighOrderDriver::in_target_units(std::vector<Vec3> coefficients) const {
  const std::size_t num_vertices = mesh_.space.num_vertices();
  for (std::size_t i = 0; i < coefficients.size(); ++i)
    coefficients[i] = target_.normalisation.diagonal * coefficients[i] +
                      (i < num_vertices ? target_.normalisation.centre : Vec3(0, 0, 0));
  return coefficients;
}

}  // namespace subvol::internal
