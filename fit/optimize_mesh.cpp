// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/optimize_mesh.h"

#include "subvol/base/error.h"
#include "subvol/base/format.h"
#include "subvol/base/option_checks.h"
#include "subvol/fit/elements/boundary_samples.h"
#include "subvol/fit/elements/ideal_boxes.h"
#include "subvol/fit/energies/closest_point_energy.h"
#include "subvol/fit/features/flat_facets.h"
#include "subvol/fit/features/followed_creases.h"
#include "subvol/fit/fits/flat_faces.h"
#include "subvol/fit/fits/region_volumes.h"
#include "subvol/fit/geometry/boundary_triangles.h"
#include "subvol/fit/geometry/self_intersection.h"
#include "subvol/fit/geometry/surface_distance.h"
#include "subvol/fit/quality/quality.h"
#include "subvol/fit/quality/region_quality.h"
#include "subvol/fit/solver/free_nodes.h"
#include "subvol/fit/stages/fit_report.h"
#include "subvol/fit/stages/quality_stages.h"
#include "subvol/fit/stages/stage_runner.h"
#include "subvol/fit/stages/untangle.h"
#include "subvol/fit/target/fit_target.h"
#include "subvol/mesh/interfaces.h"
#include "subvol/mesh/validate.h"
#include "subvol/surface/boundary.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

namespace subvol {

using namespace internal;

namespace {

constexpr double kTangentialWeight = 0.003;
/// Weight of the cells' shape against the surface while cells are untangled with a sliding boundary.
constexpr double kUntangleLambda = 0.01;
/// Correspondences of this length, as a share of the diagonal, count twice (`ClosestPointEnergy::emphasize_far`).
constexpr double kFarDistance = 0.002;
/// Quadrature points at the corners only, where cells are worst. The certificate detects cells that are inverted
/// elsewhere, and these get more points.
constexpr int kPointsPerDirection = 2;
/// Cells with a lower scaled Jacobian do not indicate their wanted size.
constexpr double kTrustedJacobian = 0.3;
/// Cells with a lower scaled Jacobian may move the corner vertices of the surface's sharp edges.
constexpr double kPoorJacobian = 0.2;

/// Distances are kept below these shares of the tolerances, since they are measured at samples, which miss the farthest
/// places.
constexpr double kMeanMargin = 0.9, kMaxMargin = 0.8;
/// Least factor to which the weight of a cell is lowered for the sake of the distance.
constexpr double kLeastRelief = 0.25;

/// Estimates of the work: its share when untangling and the rounds end, the portion of the rest that the first quality
/// stages take, and the steps of untangling.
constexpr double kShareAfterUntangling = 0.25, kShareAfterRounds = 0.5, kFirstQualityPortion = 0.7;
constexpr double kExpectedUntanglingSteps = 30;

/// Largest relative change of a region's volume at which interfaces may slide.
constexpr double kMostVolumeChange = 1e-3;
/// Largest relative change of a volume for which there is no warning.
constexpr double kToldVolumeChange = 1e-4;

/// State that a round has reached.
struct Progress {
  double mean_jacobian = -1, least_jacobian = -1, max_percent = 0;

  bool gains_on(const Progress& before, double wanted_percent) const {
    constexpr double kLeastGain = 7e-4, kLeastOfWorst = 5e-3, kLeastApproach = 0.03;
    return mean_jacobian - before.mean_jacobian >= kLeastGain ||
           least_jacobian - before.least_jacobian >= kLeastOfWorst ||
           (max_percent > wanted_percent && max_percent < (1 - kLeastApproach) * before.max_percent);
  }
};

OptimizeOptions checked(const OptimizeOptions& options, bool has_target) {
  const auto in_range = [](const char* name, double value, double low, double high) {
    require_in_range("OptimizeOptions", name, value, low, high);
  };
  in_range("crease_angle_degrees", options.crease_angle_degrees, 0, 180);
  in_range("lambda", options.lambda, 1e-9, 1e9);
  in_range("mean_tolerance_percent", options.mean_tolerance_percent, 1e-9, 100);
  in_range("max_tolerance_percent", options.max_tolerance_percent, 1e-9, 100);
  in_range("max_iterations", options.max_iterations, 0, 1e9);
  in_range("quality", options.quality, 0, kMostQuality);
  in_range("time_limit_seconds", options.time_limit_seconds, 0, 1e12);
  if (has_target && options.fixed_boundary)
    throw InputError("OptimizeOptions: a boundary that is fixed cannot be drawn to a target");
  return options;
}

VolumeMesh checked_mesh(VolumeMesh mesh) {
  for (const MeshDefect& defect : validate(mesh))
    if (defect.kind != MeshDefect::Kind::unused_vertex && defect.kind != MeshDefect::Kind::inverted_cell)
      throw InputError("mesh: " + defect.message);
  return mesh;
}

double mean_of(std::span<const double> values) {
  double sum = 0;
  for (const double v : values) sum += v;
  return sum / static_cast<double>(values.size());
}

/// One optimization, in normalized coordinates.
class MeshOptimizer {
 public:
  MeshOptimizer(const VolumeMesh& mesh, const TriangleMesh* target, const OptimizeOptions& options)
      : options_(checked(options, target)),
        mesh_(checked_mesh(mesh)),
        topology_(mesh_),
        own_boundary_(!target),
        target_(target ? *target : fan_triangles(boundary_surface(mesh_, topology_))),
        relief_(mesh.num_cells(), 1),
        runner_({SolverKind::newton, options.max_iterations, options.time_limit_seconds, options.progress,
                 options.cancelled, options.log}) {
    target_.normalisation.take_in(mesh_);
    target_.keep_interfaces(mesh_);
    interfaces_ = find_interfaces(mesh_, topology_);
    marks_ = mark_interfaces(topology_, interfaces_);
    face_groups_ = groups_of_sheets(mesh_, topology_);
    start_volumes_ = region_volumes(mesh_);
  }
  OptimizeResult run(const VolumeMesh& original);

 private:
  enum class Boundary { fixed, sliding };
  /// What is held for the sake of the regions' volumes, each after all before: nothing; the volumes, by lowering
  /// lambda; the vertices of interfaces; those of the boundary.
  enum class Held { nothing, volumes, interfaces, sheets };

  std::vector<std::array<Index, 2>> tagged_edges() const;
  void find_features();
  void sample_boundary();
  std::vector<std::uint8_t> vertices_of(std::span<const Index> cells) const;
  void release_corners(std::span<const Index> cells);
  void release_features(std::span<const Index> cells);
  void find_sizes();
  std::vector<std::uint8_t> fixed_vertices(Boundary boundary) const;
  FitProblem make_problem(Boundary boundary, double lambda, bool untangles, std::vector<Vec3>& x) const;
  std::unique_ptr<SurfaceTerm> surface_term(bool emphasize_far) const;
  StageRecord record(std::string name) const;
  bool attempt(double least_jacobian);
  /// True if nothing but the start determines the volumes.
  bool keeps_volumes() const {
    return own_boundary_ && !options_.fixed_boundary &&
           std::ranges::all_of(start_volumes_, [](double volume) { return volume > 0; });
  }
  double volume_change() const;
  bool changes_volumes() const { return volume_change() > kMostVolumeChange; }
  bool untangle_all();
  bool untangle_cells(Boundary boundary, const char* name, const UntangleOptions& options);
  bool improve();
  bool run_stage(const std::string& name, double lambda, int steps);
  struct Measured;
  Measured measure() const;
  bool is_better(const Measured& now, const Measured& before) const;
  void flatten(double least_jacobian);
  void keep_volumes();
  bool run_quality_stages(const QualitySchedule& schedule);
  bool raise_quality(double goal);
  bool raise_quality();
  bool is_worth_keeping(const Measured& now, const Measured& start) const;
  void relieve_far_cells(std::span<const double> triangle_distances);
  void weigh_cells(std::span<const double> least_jacobians);
  void measure_start();
  void measure_distance();
  bool steps_ran_out() const;
  void finish(bool going);

  OptimizeOptions options_;
  VolumeMesh mesh_;
  MeshTopology topology_;
  bool own_boundary_;
  FitTarget target_;
  Interfaces interfaces_;  ///< between regions; fitted to themselves as they are at the start
  InterfaceMarks marks_;
  Held held_ = Held::nothing;
  std::vector<Index> face_groups_;     ///< `groups_of_sheets`; empty without interfaces
  std::vector<double> start_volumes_;  ///< of the regions
  FollowedCreases creases_;
  BoundarySamples samples_;
  std::vector<Vec3> ideal_boxes_;
  std::vector<double> weights_;        ///< per cell; empty: all equal
  std::vector<std::uint8_t> refined_;  ///< 1 for sample triangles at places that are too far off: they get more points
  std::vector<double> relief_;         ///< per cell, the factor on its weight that is lowered beside places too far off
  std::vector<Index> uncertified_;
  bool gains_ended_ = false;                   ///< true if the rounds ended because they no longer gained
  double mean_percent_ = 0, max_percent_ = 0;  ///< distances at the samples of the last stage
  FitReport report_;
  StageRunner runner_;
};

/// Returns the mesh's own creases as edges of its boundary surface, which are sharp there at any angle.
std::vector<std::array<Index, 2>> MeshOptimizer::tagged_edges() const {
  std::vector<std::array<Index, 2>> edges;
  if (!own_boundary_) return edges;
  std::vector<Index> volume_vertex;  // ascending
  boundary_surface(mesh_, topology_, &volume_vertex);
  const auto number = [&](Index v) {
    return static_cast<Index>(std::lower_bound(volume_vertex.begin(), volume_vertex.end(), v) - volume_vertex.begin());
  };
  for (const CreaseEdge& crease : mesh_.tags.creases)
    if (topology_.is_boundary_edge(topology_.find_edge(crease.v0, crease.v1)))
      edges.push_back({number(crease.v0), number(crease.v1)});
  return edges;
}

void MeshOptimizer::find_features() {
  if (options_.fixed_boundary) return;
  creases_ = FollowedCreases(target_.mesh, options_.crease_angle_degrees, mesh_, tagged_edges());
  creases_.keep_interfaces(
      mesh_, options_.crease_angle_degrees,
      own_boundary_ ? FollowedCreases::InnerCurves::themselves_with_rims : FollowedCreases::InnerCurves::themselves);
  sample_boundary();
  target_.sample(samples_.points.size(), own_boundary_ ? 1 : kLeastTargetSamples);
}

void MeshOptimizer::sample_boundary() {
  constexpr int kIntervals = 2;
  samples_ = make_sheet_samples(ElementSpace(mesh_, Basis::legendre, 1), mesh_, kIntervals, mesh_.tags.creases);
  refined_.assign(samples_.triangles.size(), 0);
}

/// Marks the vertices of these cells with 1.
std::vector<std::uint8_t> MeshOptimizer::vertices_of(std::span<const Index> cells) const {
  std::vector<std::uint8_t> marked(mesh_.num_vertices(), 0);
  for (const Index c : cells)
    for (const Index v : mesh_.cell(c)) marked[v] = 1;
  return marked;
}

/// Corner vertices of cells that do not improve may slide along the feature curves that end there, but not those of
/// interfaces: the volume of a region depends on them.
void MeshOptimizer::release_corners(std::span<const Index> cells) {
  const std::vector<std::uint8_t> marked = vertices_of(cells);
  std::erase_if(mesh_.tags.corners, [&](const CornerVertex& corner) {
    return marked[corner.vertex] != 0 && !marks_.has_vertex(corner.vertex);
  });
}

/// If a boundary is folded, its sharp edges may be those of the folds, so those at the given cells are released.
void MeshOptimizer::release_features(std::span<const Index> cells) {
  const std::size_t before = mesh_.tags.creases.size();
  creases_.release(vertices_of(cells), mesh_);
  sample_boundary();
  const std::size_t released = before - mesh_.tags.creases.size();
  if (released > 0)
    report_.warnings.push_back(
        formatted("%zu of %zu sharp edges stood against valid cells and were given up", released, before));
}

void MeshOptimizer::find_sizes() {
  const double volume = target_.surface.volume();
  if (options_.sizes == CellSizes::uniform) {
    ideal_boxes_ = ideal_boxes(mesh_, mesh_.positions, volume, 0);
    return;
  }
  std::vector<std::uint8_t> trusted;
  for (const double least : measure_quality(mesh_, kPointsPerDirection).cell_minima)
    trusted.push_back(least > kTrustedJacobian);
  ideal_boxes_ = interpolated_boxes(mesh_, mesh_.positions, volume, trusted);
}

std::vector<std::uint8_t> MeshOptimizer::fixed_vertices(Boundary boundary) const {
  std::vector<std::uint8_t> fixed(mesh_.num_vertices(), 0);
  if (boundary == Boundary::fixed) {
    for (std::size_t v = 0; v < fixed.size(); ++v) fixed[v] = topology_.is_boundary_vertex(static_cast<Index>(v));
  } else if (own_boundary_) {
    for (const CornerVertex& corner : mesh_.tags.corners) fixed[corner.vertex] = 1;
  }
  for (std::size_t v = 0; v < marks_.vertices.size(); ++v) {
    const bool on_boundary = topology_.is_boundary_vertex(static_cast<Index>(v));
    if (held_ == Held::sheets && on_boundary) fixed[v] = 1;
    if ((held_ >= Held::interfaces || boundary == Boundary::fixed) && marks_.vertices[v]) fixed[v] = 1;
  }
  return fixed;
}

std::unique_ptr<SurfaceTerm> MeshOptimizer::surface_term(bool emphasize_far) const {
  const int points = samples_.triangles.size() > target_.surface.triangles().size() ? 1 : 3;
  auto surface = std::make_unique<ClosestPointEnergy>(target_.surface, samples_.triangles, samples_.points.size(),
                                                      kTangentialWeight, points);
  if (!interfaces_.empty())
    surface->set_groups(groups_of_triangles(samples_.triangle_faces, face_groups_), target_.group_of_triangle);
  if (emphasize_far) surface->emphasize_far(kFarDistance);
  surface->refine(refined_);
  if (!creases_.curves().empty())
    surface->add_creases(creases_.energy(samples_.crease_edges, samples_.points.size(),
                                         kCreaseWidth * target_.surface.length(), kTangentialWeight));
  return surface;
}

FitProblem MeshOptimizer::make_problem(Boundary boundary, double lambda, bool untangles, std::vector<Vec3>& x) const {
  FreeNodes free = free_nodes(fixed_vertices(boundary), mesh_.positions);
  x = std::move(free.unknowns);
  auto volume = std::make_unique<VolumeEnergy>(mesh_, ideal_boxes_, kPointsPerDirection);
  if (!weights_.empty()) volume->set_weights(weights_);
  const bool slides = boundary == Boundary::sliding;
  SparseMap samples = slides ? compose(samples_.positions, free.map) : SparseMap{x.size(), {0}, {}, {}};
  FitProblem problem(std::move(free.map), std::move(samples), std::move(volume),
                     slides ? surface_term(!untangles) : nullptr, lambda);
  if (slides) problem.fixed_samples = samples_.positions.apply(free.fixed);
  problem.fixed_nodes = std::move(free.fixed);
  return problem;
}

StageRecord MeshOptimizer::record(std::string name) const {
  StageRecord result;
  result.name = std::move(name);
  result.cells = mesh_.num_cells();
  return result;
}

bool MeshOptimizer::untangle_cells(Boundary boundary, const char* name, const UntangleOptions& options) {
  std::vector<Vec3> x;
  FitProblem problem = make_problem(boundary, boundary == Boundary::fixed ? 1 : kUntangleLambda, true, x);
  UntangleResult result = untangle(problem, mesh_, options, runner_, record(name), x, report_);
  problem.apply_nodes(x, mesh_.positions);
  uncertified_ = std::move(result.uncertified);
  return result.going;
}

bool MeshOptimizer::untangle_all() {
  runner_.work().begin_part(kShareAfterUntangling, kExpectedUntanglingSteps);
  const std::vector<Vec3> start = mesh_.positions;
  const UntangleOptions fixed{.tangential_weight = 0, .max_rounds = 40, .patience = options_.fixed_boundary ? 6 : 2};
  if (!untangle_cells(Boundary::fixed, "untangle, boundary fixed", fixed)) return false;
  if (uncertified_.empty() || options_.fixed_boundary) return true;
  std::vector<Index> stuck = uncertified_;
  release_corners(stuck);
  const UntangleOptions sliding{.tangential_weight = kTangentialWeight, .max_rounds = 4};
  if (!untangle_cells(Boundary::sliding, "untangle, boundary sliding", sliding)) return false;
  if (uncertified_.empty()) return true;
  stuck.insert(stuck.end(), uncertified_.begin(), uncertified_.end());
  release_features(stuck);
  mesh_.positions = start;
  return untangle_cells(Boundary::sliding, "untangle, sharp edges released", {.tangential_weight = kTangentialWeight});
}

bool MeshOptimizer::run_stage(const std::string& name, double lambda, int steps) {
  std::vector<Vec3> x;
  const Boundary boundary = options_.fixed_boundary ? Boundary::fixed : Boundary::sliding;
  FitProblem problem = make_problem(boundary, lambda, false, x);
  const bool going = runner_.run(problem, {lambda, kTangentialWeight, steps}, record(name), x, report_);
  problem.apply_nodes(x, mesh_.positions);
  if (!going) return false;
  if (auto* surface = dynamic_cast<ClosestPointEnergy*>(problem.surface.get())) {
    std::vector<Vec3> samples(problem.samples.num_rows());
    problem.apply_samples(x, samples);
    surface->forget();  // a stage from a log leaves no correspondences behind either
    surface->assign(samples);
    const auto [mean, max] = surface->assigned_distance();
    mean_percent_ = 100 * mean;
    max_percent_ = 100 * max;
    report_.stages.back().mean_distance_percent = mean_percent_;
    relieve_far_cells(surface->triangle_distances());
  }
  return true;
}

/// From now on, the cells beside places that are too far off count half as much, and their faces get more points.
/// Lowering lambda for the sake of a few places would cost shape everywhere.
void MeshOptimizer::relieve_far_cells(std::span<const double> triangle_distances) {
  std::vector<std::uint8_t> far(mesh_.num_vertices(), 0);
  for (std::size_t t = 0; t < triangle_distances.size(); ++t) {
    if (100 * triangle_distances[t] <= kMaxMargin * options_.max_tolerance_percent) continue;
    for (const Index v : topology_.face(samples_.triangle_faces[t])) far[v] = 1;
  }
  for (std::size_t t = 0; t < refined_.size(); ++t) {
    const auto face = topology_.face(samples_.triangle_faces[t]);
    if (std::any_of(face.begin(), face.end(), [&](Index v) { return far[v] != 0; })) refined_[t] = 1;
  }
  for (std::size_t c = 0; c < mesh_.num_cells(); ++c) {
    const auto cell = mesh_.cell(c);
    if (std::any_of(cell.begin(), cell.end(), [&](Index v) { return far[v] != 0; }))
      relief_[c] = std::max(relief_[c] / 2, kLeastRelief);
  }
}

void MeshOptimizer::weigh_cells(std::span<const double> least_jacobians) {
  constexpr double kLeast = 1e-3;
  weights_.clear();
  for (std::size_t c = 0; c < least_jacobians.size(); ++c)
    weights_.push_back(relief_[c] / std::max(least_jacobians[c], kLeast));
}

/// Runs rounds of a few steps; between them, ideal boxes, weights and lambda are adapted to the state reached.
bool MeshOptimizer::improve() {
  constexpr int kFirstSteps = 4, kSteps = 2, kMaxRounds = 14;
  constexpr double kLeastLambdaShare = 1.0 / 64;
  double lambda = options_.lambda;
  Progress before;
  runner_.work().begin_part(kShareAfterRounds, kFirstSteps + kSteps * kMaxRounds / 2);
  if (!run_stage(formatted("improve, lambda %g", lambda), lambda, kFirstSteps)) return false;
  for (int round = 0; round < kMaxRounds; ++round) {
    const std::vector<double> minima = measure_quality(mesh_, kPointsPerDirection).cell_minima;
    const Progress now{mean_of(minima), *std::min_element(minima.begin(), minima.end()), max_percent_};
    const bool too_far =
        mean_percent_ > kMeanMargin * options_.mean_tolerance_percent || (held_ != Held::nothing && changes_volumes());
    if (too_far && lambda > kLeastLambdaShare * options_.lambda) {
      lambda /= 2;
    } else if (!now.gains_on(before, kMaxMargin * options_.max_tolerance_percent)) {
      gains_ended_ = true;
      break;
    }
    before = now;
    if (options_.sizes == CellSizes::local)
      ideal_boxes_ = ideal_boxes(mesh_, mesh_.positions, target_.surface.volume(), 1);
    std::vector<Index> poor;
    for (std::size_t c = 0; c < minima.size(); ++c)
      if (minima[c] < kPoorJacobian) poor.push_back(static_cast<Index>(c));
    release_corners(poor);
    weigh_cells(minima);
    if (!run_stage(formatted("round %d, lambda %g", round + 1, lambda), lambda, kSteps)) return false;
  }
  return true;
}

/// Properties of a state that the quality stages must not spoil.
struct MeshOptimizer::Measured {
  double least_jacobian = -1, mean_jacobian = -1, mean_percent = 0, max_percent = 0;
  std::size_t uncertified = 0, intersections = 0;
  double volume_change = 0;  ///< largest relative change of a region's volume, if the mesh has several
};

/// Returns the largest relative change of a region's volume; 0 if the boundary has a target of its own, which changes
/// volumes.
double MeshOptimizer::volume_change() const {
  double largest = 0;
  if (!own_boundary_) return largest;
  const std::vector<double> volumes = region_volumes(mesh_);
  for (std::size_t r = 0; r < volumes.size(); ++r)
    largest = std::max(largest, std::abs(volumes[r] / start_volumes_[r] - 1));
  return largest;
}

MeshOptimizer::Measured MeshOptimizer::measure() const {
  const QualityReport quality = measure_quality(mesh_);
  Measured result{quality.min_scaled_jacobian, quality.mean_scaled_jacobian};
  result.uncertified = quality.certificate.not_certified.size();
  if (options_.fixed_boundary) return result;
  const TriangleMesh surface = refined_triangles(boundary_surface(mesh_, topology_));
  const SurfaceDistance distance = target_.distance(surface);
  result.mean_percent = 100 * distance.mean();
  result.max_percent = 100 * distance.max();
  if (!interfaces_.empty()) {
    const SurfaceDistance between = target_.interface_distance(mesh_);
    result.mean_percent = std::max(result.mean_percent, 100 * between.mean());
    result.max_percent = std::max(result.max_percent, 100 * between.max());
    result.volume_change = volume_change();
  }
  // Certified cells in a boundary that does not meet itself do not overlap, so neither do the interfaces between them.
  // Not to be interrupted: a fraction of a second, without which two states cannot be compared.
  result.intersections = count_intersecting_pairs(surface);
  return result;
}

bool MeshOptimizer::is_better(const Measured& now, const Measured& before) const {
  return now.uncertified <= before.uncertified && now.intersections <= before.intersections &&
         now.least_jacobian > before.least_jacobian &&
         now.volume_change <= std::max(before.volume_change, kMostVolumeChange) &&
         now.mean_percent <= std::max(before.mean_percent, kMeanMargin * options_.mean_tolerance_percent) &&
         now.max_percent <= std::max(before.max_percent, options_.max_tolerance_percent);
}

/// Returns true if a result is better than a start whose cells are all certified: closer to a surface that the start
/// was too far from, or of better cells at distances that are within the tolerances or no larger.
bool MeshOptimizer::is_worth_keeping(const Measured& now, const Measured& start) const {
  constexpr double kLeastGain = 1e-6;
  const double mean_limit = options_.mean_tolerance_percent, max_limit = options_.max_tolerance_percent;
  if (now.uncertified > 0 || now.intersections > start.intersections || now.volume_change > kMostVolumeChange ||
      now.mean_percent > std::max(start.mean_percent, mean_limit) ||
      now.max_percent > std::max(start.max_percent, max_limit))
    return false;
  const bool was_too_far = start.mean_percent > mean_limit || start.max_percent > max_limit;
  if (was_too_far) return now.mean_percent < start.mean_percent || now.max_percent < start.max_percent;
  const double gain = now.least_jacobian - start.least_jacobian;
  return gain > kLeastGain || (gain > -kLeastGain && now.mean_jacobian > start.mean_jacobian + kLeastGain);
}

/// Runs quality stages on the present mesh. Returns false if the work must end.
bool MeshOptimizer::run_quality_stages(const QualitySchedule& schedule) {
  const bool slides = !options_.fixed_boundary;
  FreeNodes free = free_nodes(fixed_vertices(slides ? Boundary::sliding : Boundary::fixed), mesh_.positions);
  QualityBoundary boundary;
  std::function<CreaseEnergy(double)> creases;
  if (slides) {
    boundary.samples = compose(samples_.positions, free.map);
    boundary.fixed = samples_.positions.apply(free.fixed);
    boundary.triangles = samples_.triangles;
    boundary.triangle_faces = samples_.triangle_faces;
    boundary.interfaces = interfaces_.faces;
    boundary.group_of_face = face_groups_;
    boundary.group_of_triangle = target_.group_of_triangle;
    if (!creases_.curves().empty())
      creases = [&](double width) {
        return creases_.energy(samples_.crease_edges, samples_.points.size(), width, kQualityTangentialWeight);
      };
  }
  QualityStages stages(mesh_, ideal_boxes_, free.map, free.fixed, boundary, target_.surface, creases);
  std::vector<Vec3> x = std::move(free.unknowns);
  const bool going = stages.run(schedule, runner_, record("quality"), x, report_);
  mesh_.positions = std::move(free.fixed);
  const std::vector<Vec3> moved = free.map.apply(x);
  for (std::size_t v = 0; v < moved.size(); ++v) mesh_.positions[v] += moved[v];
  return going;
}

/// Raises the least scaled Jacobian towards a goal; if the surface suffers, it counts more in another attempt. Returns
/// false if the work must end.
bool MeshOptimizer::raise_quality(double goal) {
  constexpr double kMoreSurface = 10;
  constexpr int kAttempts = 2;
  const Measured before = measure();
  if (before.least_jacobian >= goal) return true;
  const std::vector<Vec3> start = mesh_.positions;
  QualitySchedule schedule = fine_quality_schedule(goal);
  runner_.work().begin_portion(kFirstQualityPortion, 1, schedule.expected_steps());
  schedule.most_distance = std::max(kMaxMargin * options_.max_tolerance_percent, before.max_percent) / 100;
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    const std::size_t stages_before = report_.stages.size();
    const bool going = run_quality_stages(schedule);
    if (is_better(measure(), before)) return going;
    mesh_.positions = start;
    report_.undo_stages(stages_before, report_.stages.size());
    if (!going) return false;
    if (options_.fixed_boundary) break;
    schedule.give_surface_more_weight(kMoreSurface);
  }
  return true;
}

/// Raises the least scaled Jacobian to the quality that was asked for and then, from there, beyond it. Returns false if
/// the work must end.
bool MeshOptimizer::raise_quality() {
  constexpr double kBeyond = 0.1;
  if (options_.quality == 0) return true;
  if (!raise_quality(options_.quality)) return false;
  if (measure_quality(mesh_).min_scaled_jacobian < options_.quality) return true;
  return raise_quality(std::min(kMostQuality, options_.quality + kBeyond));
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

/// There is nothing to measure if the target is the mesh's own boundary.
void MeshOptimizer::measure_start() {
  if (own_boundary_) return;
  const SurfaceDistance start = target_.distance(refined_triangles(boundary_surface(mesh_, topology_)));
  report_.initial_distance_mean_percent = 100 * start.mean();
  report_.initial_distance_max_percent = 100 * start.max();
}

/// Measures the distances of the result as `check_mesh` does; the stages measured only at their own samples.
void MeshOptimizer::measure_distance() {
  if (options_.fixed_boundary) return;
  const SurfaceDistance distance = target_.distance(refined_triangles(boundary_surface(mesh_, topology_)));
  mean_percent_ = 100 * distance.mean();
  max_percent_ = 100 * distance.max();
  if (interfaces_.empty()) return;
  const SurfaceDistance between = target_.interface_distance(mesh_);
  mean_percent_ = std::max(mean_percent_, 100 * between.mean());
  max_percent_ = std::max(max_percent_, 100 * between.max());
}

/// Returns true if the caller's limit of steps, not the schedule's, ended a minimization.
bool MeshOptimizer::steps_ran_out() const {
  return options_.max_iterations > 0 &&
         std::any_of(report_.stages.begin(), report_.stages.end(), [](const StageRecord& stage) {
           return stage.kept && !stage.raises_quality && stage.ended == MinimizerStop::iteration_limit;
         });
}

void MeshOptimizer::finish(bool going) {
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
      report_.explanation += formatted("; stages took all of the %d steps allowed", options_.max_iterations);
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

OptimizeResult MeshOptimizer::run(const VolumeMesh& original) {
  measure_start();
  const Measured start = measure();
  std::vector<Vec3> start_positions = mesh_.positions;
  bool going = attempt(start.least_jacobian);
  while (going && keeps_volumes() && !interfaces_.empty() && held_ != Held::sheets && changes_volumes()) {
    report_.undo_stages(0, report_.stages.size());
    mesh_.positions = start_positions;
    mesh_.tags = original.tags;
    held_ = static_cast<Held>(static_cast<int>(held_) + 1);
    going = attempt(start.least_jacobian);
  }
  if (held_ >= Held::interfaces)
    report_.warnings.push_back(
        formatted("%s between regions were fixed: sliding changed the volume of a region by more than %g %%",
                  held_ == Held::interfaces ? "interfaces" : "the boundary and interfaces", 100 * kMostVolumeChange));
  OptimizeResult result{original, {}, {}};
  const bool wants_other_sizes = options_.sizes == CellSizes::uniform;
  if (start.uncertified > 0 || wants_other_sizes || is_worth_keeping(measure(), start)) {
    result.mesh.positions = target_.normalisation.from_unit(mesh_.positions);
  } else {
    mesh_.positions = std::move(start_positions);
    report_.undo_stages(0, report_.stages.size());
    gains_ended_ = true;
  }
  if (const double change = volume_change(); keeps_volumes() && change > kToldVolumeChange)
    report_.warnings.push_back(formatted("the volume of %s changed by %.2g %%",
                                         interfaces_.empty() ? "the mesh" : "a region", 100 * change));
  if (options_.fixed_boundary)
    for (std::size_t v = 0; v < original.num_vertices(); ++v)
      if (topology_.is_boundary_vertex(static_cast<Index>(v))) result.mesh.positions[v] = original.positions[v];
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
