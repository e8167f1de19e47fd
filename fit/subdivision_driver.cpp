// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/subdivision_driver.h"

#include "subvol/base/error.h"
#include "subvol/base/format.h"
#include "subvol/base/option_checks.h"
#include "subvol/fit/certificate/certificate.h"
#include "subvol/fit/elements/ideal_boxes.h"
#include "subvol/fit/energies/make_surface_term.h"
#include "subvol/fit/energies/volume_energy.h"
#include "subvol/fit/geometry/boundary_triangles.h"
#include "subvol/fit/geometry/self_intersection.h"
#include "subvol/fit/quality/quality.h"
#include "subvol/fit/stages/solve_control.h"
#include "subvol/mesh/mesh_topology.h"
#include "subvol/mesh/pyramids.h"
#include "subvol/mesh/validate.h"
#include "subvol/subdivision/audit.h"
#include "subvol/surface/boundary.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <stdexcept>
#include <utility>

namespace subvol::internal {

namespace {

void check_options(const FitOptions& options) {
  const auto in_range = [](const char* name, double value, double low, double high) {
    require_in_range("FitOptions", name, value, low, high);
  };
  in_range("levels", options.levels, 1, 6);
  in_range("lambda_far", options.lambda_far, 1e-9, 1e9);
  in_range("lambda_close", options.lambda_close, 1e-9, 1e9);
  in_range("quality", options.quality, 0, kMostQuality);
  check_control("FitOptions", options.control);
  in_range("memory_limit_bytes", options.memory_limit_bytes, 0, 1e18);
  if (options.tolerance_percent) in_range("tolerance_percent", *options.tolerance_percent, 1e-9, 100);
  if (options.crease_angle_degrees) in_range("crease_angle_degrees", *options.crease_angle_degrees, 0, 180);
  if (options.frees_mesh && (options.cage_only || options.keep_states))
    throw InputError("FitOptions: frees_mesh does not go with cage_only or keep_states, which need the cage");
}

}  // namespace

SubdivisionDriver::SubdivisionDriver(FitTarget target, const VolumeMesh& template_mesh, const FitOptions& options,
                                     int levels_before)
    : StagedFit(options.keep_states),
      options_((check_options(options), options)),
      target_(std::move(target)),
      template_(template_mesh),
      levels_before_(levels_before),
      memory_(options.memory_limit_bytes, kMemoryOfLevelCell),
      runner_(options.control, options.solver, options.tuning) {
  require_valid(template_mesh, "template mesh");
  require_no_pyramids(template_.kinds,
                      "template mesh: pyramids do not split into hexes, because four edges meet at their apex");
  target_.normalization.take_in(template_);
  template_creases_ = creases_along_target(target_, crease_rule(), template_);
}

void SubdivisionDriver::look_over_template() {
  FitReport& report = result_.report;
  report.warnings = audit(template_).warnings;
  const StartComparison start =
      target_.compare_start(refined_triangles(boundary_surface(template_, MeshTopology(template_))));
  report.note_start(start);
  schedule_ =
      make_schedule(options_, start.mean_distance / target_.surface.length(), template_creases_.hold_the_surface());
  keep_interfaces(crease_rule(), target_, template_creases_, template_, report);
}

void SubdivisionDriver::prepare_level() {
  const double begin = runner_.seconds();
  level_ = make_fit_level(control_, from_unknowns_, previous_nodes_, options_, target_.surface.num_details(), finest());
  limit_check_.reset();
  known_distances_.reset();
  creases_.refine(level_.parent_creases);
  sample_target();
  ideal_boxes_ = ideal_boxes(level_.mesh, level_.safe_nodes.apply(unknowns_), target_.surface.volume(),
                             number_ == 1 ? own_box_share_ : 1);
  seconds_["levels"] += runner_.seconds() - begin;
}

/// Samples the target as densely as the level can follow it: more correspondences cost time and change nothing. On the
/// finest level, a target that has far more detail counts fully in the end only (`fit_all_samples`).
void SubdivisionDriver::sample_target() {
  const FitTuning& tuning = options_.tuning.fitting;
  const std::size_t samples = level_.samples.num_rows();
  const auto count = [](int number) { return static_cast<std::size_t>(number); };
  const std::size_t most = count(tuning.most_per_sample) * samples, many = count(tuning.least_target_samples);
  samples_all_ = true;
  if (finest()) {
    target_.sample(samples, many);
    if (target_.surface.samples().size() <= count(tuning.far_too_many_per_sample) * samples) return;
    samples_all_ = target_.surface.is_cloud();
    target_.surface.thin(most);
  } else {
    const std::size_t quads = MeshTopology(level_.mesh).boundary_faces().size();
    const std::size_t few = std::min(count(tuning.least_coarse_samples), many);
    target_.sample(samples, std::clamp(count(tuning.samples_per_quad) * quads, few, many), most);
  }
}

/// Ends a fit to some of the target's samples with a few steps toward all of them, and rolls them back if more of the
/// boundary's triangles intersect then. Returns false if the fit must end.
bool SubdivisionDriver::fit_all_samples() {
  constexpr int kAllSamplesSteps = 2;  // the state is close to a minimum already
  if (samples_all_) return true;
  const std::optional<std::size_t> pairs = intersecting_pairs();
  if (!pairs) return false;
  FitSnapshot start = snapshot();
  target_.sample(level_.samples.num_rows(), static_cast<std::size_t>(options_.tuning.fitting.least_target_samples));
  samples_all_ = true;
  Stage stage = schedule_.final_stage(lambda_);
  stage.max_iterations = kAllSamplesSteps;
  if (!run_stage(stage, stage_name(stage) + ", all of the target")) return false;
  const std::optional<std::size_t> pairs_now = intersecting_pairs();
  if (pairs_now && *pairs_now > *pairs) go_back(std::move(start));
  return pairs_now.has_value();
}

std::string SubdivisionDriver::stage_name(const Stage& stage) const {
  return formatted("level %d, lambda %g, tangential weight %g", level(), stage.lambda, stage.tangential_weight);
}

std::unique_ptr<SurfaceTerm> SubdivisionDriver::surface_term(const Stage& stage) const {
  std::unique_ptr<SurfaceTerm> term = make_surface_term(
      target_.surface, level_.sample_triangles, level_.samples.num_rows(), stage.tangential_weight,
      options_.correspondence, SurfacePull::along_normals, 0, {}, {level_.sample_groups, target_.group_of_triangle});
  if (!creases_.curves().empty())
    term->add_creases(creases_.energy(level_.crease_edges, level_.samples.num_rows(),
                                      kCreaseWidth * target_.surface.length(), stage.tangential_weight));
  return term;
}

bool SubdivisionDriver::run_stage(const Stage& stage, const std::string& name) {
  if (!runner_.in_time(name, result_.report)) return false;
  StageRecord record;
  record.name = try_ == 1 ? name : formatted("try %d, ", try_) + name;
  record.level = level();
  record.cells = level_.mesh.num_cells();
  keep_state();
  lambda_ = stage.lambda;
  auto volume = std::make_unique<VolumeEnergy>(level_.mesh, ideal_boxes_, schedule_.quadrature_points(number_));
  volume->set_distortion(options_.distortion);
  FitProblem problem(level_.nodes, level_.samples, std::move(volume), surface_term(stage), stage.lambda);
  const double begin = runner_.seconds();
  const bool going = runner_.run(problem, stage, std::move(record), unknowns_, result_.report);
  seconds_["solve"] += runner_.seconds() - begin;
  mean_.reset();
  return going;
}

/// Makes the level's start valid by continuation from the linear split L of the level below:
///   M_t = (1 - t) L + t M; a few minimizer steps at each t that is feasible, until t = 1.
bool SubdivisionDriver::start_level() {
  constexpr int kMostContinuationRounds = 60;  // to bound the time
  const SparseMap nodes = level_.nodes;
  const std::vector<Index> failing_before = certify(level_.safe_nodes.apply(unknowns_), level_.mesh).not_certified;
  std::vector<Vec3> safe, wanted;  // the nodes at t = 0 and t = 1
  const auto feasible = [&](double t) {
    std::vector<Vec3> x(wanted.size());
    for (std::size_t i = 0; i < x.size(); ++i) x[i] = (1 - t) * safe[i] + t * wanted[i];
    const std::vector<Index> failing = certify(x, level_.mesh).not_certified;
    return std::includes(failing_before.begin(), failing_before.end(), failing.begin(), failing.end());
  };
  Stage stage = schedule_.continuation;
  double t = 0;
  for (int round = 0; round < kMostContinuationRounds; ++round) {
    safe = level_.safe_nodes.apply(unknowns_);
    wanted = nodes.apply(unknowns_);
    double next = 1;
    while (next > t && !feasible(next)) {
      next = t + options_.tuning.fitting.back_off * (next - t);
      if (next - t <= options_.tuning.fitting.least_progress) next = t;
    }
    // Cells that block the way need better shapes before they can follow.
    const bool slow = next - t < options_.tuning.fitting.slow_share * (1 - t);
    if (next > t)
      t = next;
    else if (stage.lambda >= options_.lambda_far)
      break;
    if (slow) stage.lambda = std::min(4 * stage.lambda, std::max(stage.lambda, options_.lambda_far));
    level_.nodes = t == 1 ? nodes : blend(level_.safe_nodes, nodes, t);
    if (t == 1) return true;
    if (!run_stage(stage, formatted("level %d, continuation t = %.3f, lambda %g", level(), t, stage.lambda)))
      return false;
  }
  level_.nodes = blend(level_.safe_nodes, nodes, t);
  result_.report.stop_reason = StopReason::stalled;
  result_.report.explanation =
      formatted("level %d could not be reached without inverting a cell (%.0f %% of the way)", level(), 100 * t);
  return false;
}

TriangleMesh SubdivisionDriver::limit_triangles() {
  if (!limit_check_) limit_check_ = refine_sheets(level_.mesh, limit_refinements(level_.mesh));
  return internal::limit_triangles(level_, *limit_check_, from_unknowns_.apply(unknowns_));
}

const std::vector<SurfaceDistance>& SubdivisionDriver::distances(bool extremes) {
  if (known_distances_ && known_distances_->unknowns == unknowns_ && (known_distances_->extremes || !extremes))
    return known_distances_->distances;
  const double begin = runner_.seconds();
  KnownDistances known{unknowns_, extremes, {}};
  const VolumeMesh mesh = current_mesh();
  known.distances.push_back(target_.distance(refined_triangles(boundary_surface(mesh, MeshTopology(mesh))), extremes));
  if (target_.has_interfaces()) known.distances.push_back(target_.interface_distance(mesh));
  if (options_.surface == FittedSurface::limit)
    known.distances.push_back(target_.distance(limit_triangles(), extremes));
  seconds_["distance"] += runner_.seconds() - begin;
  return known_distances_.emplace(std::move(known)).distances;
}

void SubdivisionDriver::note_mean(std::span<const SurfaceDistance> distances) {
  mean_ = 0;
  for (const SurfaceDistance& distance : distances) mean_ = std::max(*mean_, 100 * distance.mean());
  if (StageRecord* stage = result_.report.last_kept_stage()) stage->mean_distance_percent = *mean_;
}

/// Returns the mean distance between the target and the fit, in percent of the diagonal: the largest one of the finite
/// element mesh's, of its interfaces', and of the limit surface's. If the quality is to be raised from this state, the
/// largest distances are needed then, so they are measured at once.
double SubdivisionDriver::measured_mean() {
  if (!mean_) note_mean(distances(finest() && options_.quality > 0));
  return *mean_;
}

VolumeMesh SubdivisionDriver::current_mesh() const {
  VolumeMesh mesh = level_.mesh;
  mesh.positions = level_.nodes.apply(unknowns_);
  return mesh;
}

double SubdivisionDriver::mean_scaled_jacobian() const { return measure_quality(current_mesh()).mean_scaled_jacobian; }

std::optional<std::size_t> SubdivisionDriver::intersecting_pairs() {
  const VolumeMesh mesh = current_mesh();
  return runner_.intersecting_pairs(refined_triangles(boundary_surface(mesh, MeshTopology(mesh))), result_.report);
}

bool SubdivisionDriver::meets_tolerance() {
  return options_.tolerance_percent && measured_mean() <= *options_.tolerance_percent;
}

double SubdivisionDriver::Measured::largest() const {
  double largest = 0;
  for (const SurfaceDistance& distance : distances) largest = std::max(largest, distance.max());
  return largest;
}

bool SubdivisionDriver::Measured::gains_on(const Measured& before, std::optional<double> tolerance_percent,
                                           const QualityTuning& tuning) const {
  double farthest_mean_before = 0, farthest_max_before = 0;
  bool no_mean_rises = true;
  for (std::size_t i = 0; i < distances.size(); ++i) {
    farthest_mean_before = std::max(farthest_mean_before, before.distances[i].mean());
    farthest_max_before = std::max(farthest_max_before, before.distances[i].max());
    no_mean_rises = no_mean_rises && distances[i].mean() <= before.distances[i].mean();
  }
  const auto most = [&](double distance, double farthest, double factor) {
    return std::max(factor * distance, std::min(tuning.most_nearer_distance_factor * distance, farthest));
  };
  for (std::size_t i = 0; i < distances.size(); ++i) {
    const double mean = distances[i].mean(), mean_before = before.distances[i].mean();
    const bool misses = tolerance_percent && 100 * mean > *tolerance_percent && mean > mean_before;
    if (misses || mean > most(mean_before, farthest_mean_before, tuning.most_distance_factor) ||
        distances[i].max() > most(before.distances[i].max(), farthest_max_before,
                                  no_mean_rises ? tuning.most_farthest_place_factor : tuning.most_distance_factor))
      return false;
  }
  return least_jacobian > before.least_jacobian && uncertified <= before.uncertified && pairs <= before.pairs;
}

std::optional<SubdivisionDriver::Measured> SubdivisionDriver::measure(bool past_limit) {
  const VolumeMesh mesh = current_mesh();
  const QualityReport quality = measure_quality(mesh);
  const TriangleMesh surface = refined_triangles(boundary_surface(mesh, MeshTopology(mesh)));
  const std::optional<std::size_t> pairs =
      past_limit ? self_intersections(surface).pairs.size() : runner_.intersecting_pairs(surface, result_.report);
  if (!pairs) return std::nullopt;
  note_mean(distances(true));
  return Measured{quality.min_scaled_jacobian, quality.certificate.not_certified.size(), *pairs, distances(true)};
}

bool SubdivisionDriver::run_quality_stages(const QualitySchedule& schedule) {
  const auto creases = [&](double width) {
    return creases_.energy(level_.crease_edges, level_.samples.num_rows(), width,
                           options_.tuning.quality.tangential_weight);
  };
  const bool has_creases = !creases_.curves().empty();
  QualityStages stages(level_.mesh, ideal_boxes_, level_.nodes, {},
                       {level_.samples,
                        {},
                        level_.sample_triangles,
                        level_.sample_faces,
                        level_.interfaces,
                        level_.face_groups,
                        target_.group_of_triangle},
                       target_.surface, has_creases ? std::function<CreaseEnergy(double)>(creases) : nullptr,
                       options_.tuning.quality);
  stages.before_stage = [this] { keep_state(); };
  StageRecord record;
  record.name = formatted("level %d, quality", level());
  record.level = level();
  record.cells = level_.mesh.num_cells();
  const double begin = runner_.seconds();
  const bool going = stages.run(schedule, runner_, record, unknowns_, result_.report);
  seconds_["quality"] += runner_.seconds() - begin;
  mean_.reset();
  return going;
}

/// Stores the whole state or nothing, since memory may run out here.
void SubdivisionDriver::store_result() {
  FitResult stored{cage_, level_.mesh, {}, states_, level()};
  stored.cage.positions = target_.normalization.from_unit(unknowns_);
  stored.mesh.positions = target_.normalization.from_unit(level_.nodes.apply(unknowns_));
  for (FitState& state : stored.states) state.positions = target_.normalization.from_unit(std::move(state.positions));
  if (!creases_.curves().empty()) {
    const TriangleMesh limit = limit_triangles();
    CreaseDistance creases = creases_.distance(limit_check_->crease_edges, limit.positions, 1);
    creases.farthest = target_.normalization.from_unit({creases.farthest})[0];
    result_.report.creases = creases;
  }
  result_.cage = std::move(stored.cage);
  result_.mesh = std::move(stored.mesh);
  result_.states = std::move(stored.states);
  result_.level = stored.level;
  result_stages_ = {try_begin_, result_.report.stages.size()};
}

/// Makes the refined mesh the next control mesh (paper: section 4.3). In cage-only fits, the degrees of freedom stay.
void SubdivisionDriver::next_control() {
  control_ = std::move(level_.mesh);
  if (options_.cage_only) {
    from_unknowns_ = compose(level_.refine, from_unknowns_);
    previous_nodes_ = level_.nodes;
    control_.positions = from_unknowns_.apply(unknowns_);
    return;
  }
  unknowns_ = level_.refine.apply(unknowns_);
  for (FitState& state : states_) state.positions = level_.refine.apply(state.positions);
  control_.positions = unknowns_;
  cage_ = control_;
  from_unknowns_ = identity_map(unknowns_.size());
  previous_nodes_ = options_.surface == FittedSurface::limit ? limit_map(control_) : from_unknowns_;
}

void SubdivisionDriver::begin(double own_box_share) {
  ++try_;
  try_begin_ = result_.report.stages.size();
  own_box_share_ = own_box_share;
  control_ = cage_ = template_;
  creases_ = template_creases_;
  unknowns_ = control_.positions;
  states_.clear();
  from_unknowns_ = previous_nodes_ = identity_map(unknowns_.size());
}

bool SubdivisionDriver::end_for_memory(const std::string& why) {
  if (result_.mesh.num_cells() == 0 && levels_before_ == 0) throw std::runtime_error("out of memory: " + why);
  result_.report.stop_reason = StopReason::memory_limit;
  result_.report.explanation = why;
  return false;
}

bool SubdivisionDriver::has_room() {
  std::size_t cells = 0;
  for (const CellKind kind : control_.kinds) cells += static_cast<std::size_t>(cell_topology(kind).num_vertices);
  return memory_.allows(cells) || end_for_memory(memory_.refusal(formatted("level %d of %zu cells", level(), cells)));
}

}  // namespace subvol::internal
