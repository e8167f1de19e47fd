// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/optimize_driver.h"

#include "subvol/base/error.h"
#include "subvol/base/format.h"
#include "subvol/base/option_checks.h"
#include "subvol/fit/elements/ideal_boxes.h"
#include "subvol/fit/energies/closest_point_energy.h"
#include "subvol/fit/energies/volume_energy.h"
#include "subvol/fit/geometry/boundary_triangles.h"
#include "subvol/fit/geometry/self_intersection.h"
#include "subvol/fit/geometry/surface_distance.h"
#include "subvol/fit/quality/quality.h"
#include "subvol/fit/quality/region_quality.h"
#include "subvol/fit/solver/free_nodes.h"
#include "subvol/fit/stages/solve_control.h"
#include "subvol/mesh/validate.h"
#include "subvol/surface/boundary.h"

#include <cmath>
#include <functional>
#include <utility>

namespace subvol::internal {

namespace {

OptimizeOptions checked(const OptimizeOptions& options, bool has_target) {
  const auto in_range = [](const char* name, double value, double low, double high) {
    require_in_range("OptimizeOptions", name, value, low, high);
  };
  in_range("crease_angle_degrees", options.crease_angle_degrees, 0, 180);
  in_range("lambda", options.lambda, 1e-9, 1e9);
  in_range("mean_tolerance_percent", options.mean_tolerance_percent, 1e-9, 100);
  in_range("max_tolerance_percent", options.max_tolerance_percent, 1e-9, 100);
  check_control("OptimizeOptions", options.control);
  in_range("quality", options.quality, 0, kMostQuality);
  if (has_target && options.fixed_boundary)
    throw InputError("OptimizeOptions: a boundary that is fixed cannot be drawn to a target");
  return options;
}

VolumeMesh checked_mesh(VolumeMesh mesh) {
  require_valid(mesh, "mesh", InvertedCells::allowed);
  return mesh;
}

}  // namespace

OptimizeDriver::OptimizeDriver(const VolumeMesh& mesh, const TriangleMesh* target, const OptimizeOptions& options)
    : options_(checked(options, target)),
      mesh_(checked_mesh(mesh)),
      topology_(mesh_),
      own_boundary_(!target),
      target_(target ? *target : fan_triangles(boundary_surface(mesh_, topology_))),
      relief_(mesh.num_cells(), 1),
      runner_(options.control, SolverKind::newton, options.tuning) {
  target_.normalization.take_in(mesh_);
  target_.keep_interfaces(mesh_);
  interfaces_ = find_interfaces(mesh_, topology_);
  marks_ = mark_interfaces(topology_, interfaces_);
  face_groups_ = groups_of_sheets(mesh_, topology_);
  start_volumes_ = region_volumes(mesh_);
}

/// Returns the mesh's own creases as edges of its boundary surface, which are sharp there at any angle.
std::vector<std::array<Index, 2>> OptimizeDriver::tagged_edges() const {
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

void OptimizeDriver::find_features() {
  if (options_.fixed_boundary) return;
  creases_ = FollowedCreases(target_.mesh, options_.crease_angle_degrees, mesh_, tagged_edges());
  creases_.keep_interfaces(
      mesh_, options_.crease_angle_degrees,
      own_boundary_ ? FollowedCreases::InnerCurves::themselves_with_rims : FollowedCreases::InnerCurves::themselves);
  sample_boundary();
  target_.sample(samples_.points.size(),
                 own_boundary_ ? 1 : static_cast<std::size_t>(options_.tuning.fitting.least_target_samples));
}

void OptimizeDriver::sample_boundary() {
  constexpr int kSampleIntervalsPerEdge = 2;  // corners, middles of edges and of faces
  samples_ =
      make_sheet_samples(ElementSpace(mesh_, Basis::legendre, 1), mesh_, kSampleIntervalsPerEdge, mesh_.tags.creases);
  refined_.assign(samples_.triangles.size(), 0);
}

/// Marks the vertices of these cells with 1.
std::vector<std::uint8_t> OptimizeDriver::vertices_of(std::span<const Index> cells) const {
  std::vector<std::uint8_t> marked(mesh_.num_vertices(), 0);
  for (const Index c : cells)
    for (const Index v : mesh_.cell(c)) marked[v] = 1;
  return marked;
}

/// Corner vertices of cells that do not improve may slide along the feature curves that end there, but not those of
/// interfaces: the volume of a region depends on them.
void OptimizeDriver::release_corners(std::span<const Index> cells) {
  const std::vector<std::uint8_t> marked = vertices_of(cells);
  std::erase_if(mesh_.tags.corners, [&](const CornerVertex& corner) {
    return marked[corner.vertex] != 0 && !marks_.has_vertex(corner.vertex);
  });
}

/// If a boundary is folded, its sharp edges may be those of the folds, so those at the given cells are released.
void OptimizeDriver::release_features(std::span<const Index> cells) {
  const std::size_t before = mesh_.tags.creases.size();
  creases_.release(vertices_of(cells), mesh_);
  sample_boundary();
  const std::size_t released = before - mesh_.tags.creases.size();
  if (released > 0)
    report_.warnings.push_back(
        formatted("%zu of %zu sharp edges stood against valid cells and were given up", released, before));
}

void OptimizeDriver::find_sizes() {
  const double volume = target_.surface.volume();
  if (options_.sizes == CellSizes::uniform) {
    ideal_boxes_ = ideal_boxes(mesh_, mesh_.positions, volume, 0);
    return;
  }
  std::vector<std::uint8_t> trusted;
  for (const double least : measure_quality(mesh_, kCornerPoints).cell_minima)
    trusted.push_back(least > options_.tuning.optimize.trusted_jacobian);
  ideal_boxes_ = interpolated_boxes(mesh_, mesh_.positions, volume, trusted);
}

std::vector<std::uint8_t> OptimizeDriver::fixed_vertices(Boundary boundary) const {
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

std::unique_ptr<SurfaceTerm> OptimizeDriver::surface_term(bool emphasize_far) const {
  const int points = samples_.triangles.size() > target_.surface.triangles().size() ? 1 : 3;
  auto surface = std::make_unique<ClosestPointEnergy>(target_.surface, samples_.triangles, samples_.points.size(),
                                                      kOptimizeTangentialWeight, points);
  if (!interfaces_.empty())
    surface->set_groups(groups_of_triangles(samples_.triangle_faces, face_groups_), target_.group_of_triangle);
  if (emphasize_far) surface->emphasize_far(options_.tuning.optimize.far_distance);
  surface->refine(refined_);
  if (!creases_.curves().empty())
    surface->add_creases(creases_.energy(samples_.crease_edges, samples_.points.size(),
                                         kCreaseWidth * target_.surface.length(), kOptimizeTangentialWeight));
  return surface;
}

FitProblem OptimizeDriver::make_problem(Boundary boundary, double lambda, bool untangles, std::vector<Vec3>& x) const {
  FreeNodes free = free_nodes(fixed_vertices(boundary), mesh_.positions);
  x = std::move(free.unknowns);
  auto volume = std::make_unique<VolumeEnergy>(mesh_, ideal_boxes_, kCornerPoints);
  if (!weights_.empty()) volume->set_weights(weights_);
  const bool slides = boundary == Boundary::sliding;
  SparseMap samples = slides ? compose(samples_.positions, free.map) : SparseMap{x.size(), {0}, {}, {}};
  FitProblem problem(std::move(free.map), std::move(samples), std::move(volume),
                     slides ? surface_term(!untangles) : nullptr, lambda);
  if (slides) problem.fixed_samples = samples_.positions.apply(free.fixed);
  problem.fixed_nodes = std::move(free.fixed);
  return problem;
}

StageRecord OptimizeDriver::record(std::string name) const {
  StageRecord result;
  result.name = std::move(name);
  result.cells = mesh_.num_cells();
  return result;
}

bool OptimizeDriver::run_stage(const std::string& name, double lambda, int steps) {
  std::vector<Vec3> x;
  const Boundary boundary = options_.fixed_boundary ? Boundary::fixed : Boundary::sliding;
  FitProblem problem = make_problem(boundary, lambda, false, x);
  const bool going = runner_.run(problem, {lambda, kOptimizeTangentialWeight, steps}, record(name), x, report_);
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
void OptimizeDriver::relieve_far_cells(std::span<const double> triangle_distances) {
  std::vector<std::uint8_t> far(mesh_.num_vertices(), 0);
  for (std::size_t t = 0; t < triangle_distances.size(); ++t) {
    if (100 * triangle_distances[t] <= options_.tuning.optimize.max_share_of_tolerance * options_.max_tolerance_percent)
      continue;
    for (const Index v : topology_.face(samples_.triangle_faces[t])) far[v] = 1;
  }
  for (std::size_t t = 0; t < refined_.size(); ++t) {
    const auto face = topology_.face(samples_.triangle_faces[t]);
    if (std::any_of(face.begin(), face.end(), [&](Index v) { return far[v] != 0; })) refined_[t] = 1;
  }
  for (std::size_t c = 0; c < mesh_.num_cells(); ++c) {
    const auto cell = mesh_.cell(c);
    if (std::any_of(cell.begin(), cell.end(), [&](Index v) { return far[v] != 0; }))
      relief_[c] = std::max(relief_[c] / 2, options_.tuning.optimize.least_relief);
  }
}

void OptimizeDriver::weigh_cells(std::span<const double> least_jacobians) {
  constexpr double kLeastWeighedJacobian = 1e-3;  // scaled Jacobian; no cell weighs more than a thousand ideal ones
  weights_.clear();
  for (std::size_t c = 0; c < least_jacobians.size(); ++c)
    weights_.push_back(relief_[c] / std::max(least_jacobians[c], kLeastWeighedJacobian));
}

/// Returns the largest relative change of a region's volume; 0 if the boundary has a target of its own, which changes
/// volumes.
double OptimizeDriver::volume_change() const {
  double largest = 0;
  if (!own_boundary_) return largest;
  const std::vector<double> volumes = region_volumes(mesh_);
  for (std::size_t r = 0; r < volumes.size(); ++r)
    largest = std::max(largest, std::abs(volumes[r] / start_volumes_[r] - 1));
  return largest;
}

OptimizeDriver::Measured OptimizeDriver::measure() const {
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
  // Not to be interrupted: two states cannot be compared without it. It takes some seconds for a million faces.
  result.intersections = count_intersecting_pairs(surface);
  return result;
}

/// Runs quality stages on the present mesh. Returns false if the work must end.
bool OptimizeDriver::run_quality_stages(const QualitySchedule& schedule) {
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
        return creases_.energy(samples_.crease_edges, samples_.points.size(), width,
                               options_.tuning.quality.tangential_weight);
      };
  }
  QualityStages stages(mesh_, ideal_boxes_, free.map, free.fixed, boundary, target_.surface, creases,
                       options_.tuning.quality);
  std::vector<Vec3> x = std::move(free.unknowns);
  const bool going = stages.run(schedule, runner_, record("quality"), x, report_);
  mesh_.positions = std::move(free.fixed);
  const std::vector<Vec3> moved = free.map.apply(x);
  for (std::size_t v = 0; v < moved.size(); ++v) mesh_.positions[v] += moved[v];
  return going;
}

/// There is nothing to measure if the target is the mesh's own boundary.
void OptimizeDriver::measure_start() {
  if (own_boundary_) return;
  const SurfaceDistance start = target_.distance(refined_triangles(boundary_surface(mesh_, topology_)));
  report_.initial_distance_mean_percent = 100 * start.mean();
  report_.initial_distance_max_percent = 100 * start.max();
}

/// Records how well sharp edges of a target are followed.
void OptimizeDriver::measure_creases() {
  if (own_boundary_ || creases_.curves().empty()) return;
  CreaseDistance creases = creases_.distance(samples_.crease_edges, samples_.positions.apply(mesh_.positions), 1);
  creases.farthest = target_.normalization.from_unit({creases.farthest})[0];
  report_.creases = creases;
}

/// Measures the distances of the result as `check_mesh` does; the stages measured only at their own samples.
void OptimizeDriver::measure_distance() {
  if (options_.fixed_boundary) return;
  const SurfaceDistance distance = target_.distance(refined_triangles(boundary_surface(mesh_, topology_)));
  mean_percent_ = 100 * distance.mean();
  max_percent_ = 100 * distance.max();
  if (interfaces_.empty()) return;
  const SurfaceDistance between = target_.interface_distance(mesh_);
  mean_percent_ = std::max(mean_percent_, 100 * between.mean());
  max_percent_ = std::max(max_percent_, 100 * between.max());
}

}  // namespace subvol::internal
