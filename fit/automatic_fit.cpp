// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/automatic_fit.h"

#include "subvol/base/error.h"
#include "subvol/base/format.h"
#include "subvol/fit/automatic_attempts.h"
#include "subvol/fit/automatic_driver.h"
#include "subvol/fit/automatic_groups.h"
#include "subvol/fit/automatic_state.h"
#include "subvol/fit/certificate/certificate.h"
#include "subvol/fit/features/crisp_edges.h"
#include "subvol/fit/features/edge_layout.h"
#include "subvol/fit/features/feature_routing.h"
#include "subvol/fit/features/flat_facets.h"
#include "subvol/fit/features/polyline.h"
#include "subvol/fit/fits/flat_faces.h"
#include "subvol/fit/fits/graded_template.h"
#include "subvol/fit/fits/level_samples.h"
#include "subvol/fit/fits/local_cells.h"
#include "subvol/fit/fits/smooth_refinement.h"
#include "subvol/fit/geometry/boundary_triangles.h"
#include "subvol/fit/geometry/closest_point.h"
#include "subvol/fit/geometry/self_intersection.h"
#include "subvol/fit/mending/surface_repair.h"
#include "subvol/fit/quality/quality.h"
#include "subvol/fit/stages/quality_stages.h"
#include "subvol/fit/target/fit_target.h"
#include "subvol/mesh/mesh_topology.h"
#include "subvol/surface/boundary.h"
#include "subvol/surface/welded_surface.h"
#include "subvol/templates/auto_template.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <optional>
#include <span>
#include <string>
#include <utility>

namespace subvol {

using namespace internal;

namespace {

constexpr double kRoomForTemplates = 0.85;  // share of the cells allowed that a template is asked for first
constexpr double kMostGrowth = 1.5;         // of the number of cells by cutting some of them
/// Largest share of the cells allowed that a template may have if some of its cells are to be cut.
constexpr double kMostShareOfGrid = 0.75;
/// Largest number of rounds in which some cells are cut: cells of size 1 / 9 are the smallest. The fits with edges that
/// had a second round (i07 twice, fan-shroud) gained nothing by it.
constexpr int kMostRefinements = 2, kMostRefinementsWithEdges = 1;
/// Largest number of routings of one grid. Each gives up edges at which the one before left poor cells.
constexpr int kMostRoutings = 5;
/// Merit above which a fit that follows edges is worth a refinement, which takes at least as long as the fit did.
constexpr double kWorthRefining = 0.5;

/// An automatic fit of one solid.
class AutomaticFit : AutomaticDriver {
 public:
  /// target: must outlive this; if edges are followed, its triangles agree about what is inside.
  AutomaticFit(const TriangleMesh& target, EdgeChoice follows, const AutomaticFitOptions& options)
      : AutomaticDriver(options, target), original_(target), follows_(follows) {}
  AutomaticFitResult run();

 private:
  void find_edges();
  void find_features();
  bool run_attempt(const AutomaticAttempt& attempt);
  bool run_smooth(const AutomaticAttempt& attempt);
  bool run_edges(const AutomaticAttempt& attempt);
  bool run_graded();
  bool run_refined();
  void lay_out(RoutingOptions routing);
  void begin_cage() override;
  bool fit_smoothly(SizedMesh grid, AutomaticAttempt::Kind kind);
  bool fit_future_cage(RoutingOptions& routing);
  bool route_and_fit(const AutomaticFitTrial& described);
  std::vector<Fault> faults_of_best() const;
  std::vector<double> faults_of_cells() const;
  std::optional<AutoTemplate> make_template(AutoTemplateOptions options);
  std::optional<AutoTemplate> make_template_of_at_most(std::size_t cells);
  bool fit_level(int level, const QualitySchedule& schedule, const char* what, double portion = 1) override;
  std::optional<FeatureMiss> feature_miss(const TriangleMesh& surface) const;
  std::optional<CreaseDistance> distance_of_edges() const;
  std::vector<UnfollowedCurve> unfollowed_curves() const;
  bool judge(AutomaticFitTrial trial) override;
  bool is_worth_trying(const AutomaticAttempt& attempt) const {
    // A grid without planes is the grid of the attempt before; with many of them, grids not through them are worse.
    constexpr double kMany = 0.4;
    return attempt.kind != AutomaticAttempt::Kind::edges || (aligned_share_ > 0 && aligned_share_ < kMany);
  }
  /// Number of cells up to which a fit is refined, if the number is free.
  static double most_refined_cells() { return kMostGrowth * static_cast<double>(kAutomaticCells.back()); }
  /// More cells are tried on a surface without edges as long as an aim is missed at all: they cost little there.
  bool is_strict() const { return !follows_.any() && !options_.makes_cage; }
  bool ends_search() const {
    constexpr double kNearlyAll = 0.95;  // of the quality: what is left is worth no more cells
    return is_good() && (!is_strict() || (meets_distances(best(), options_) && best().least_share >= kNearlyAll));
  }
  void take_best();
  /// Cages are not refined: cells that are cut have irregular edges, whose subdivision surfaces are poor.
  /// Nor are larger meshes, if the number of cells is free: it takes minutes and gains little.
  bool is_worth_refining() const {
    const bool has_room = options_.cells || static_cast<double>(best().cells) <= most_refined_cells();
    return !options_.makes_cage && !is_good() && has_room &&
           (best_start_.kind == AutomaticAttempt::Kind::smooth || best().merit > kWorthRefining);
  }

  const TriangleMesh& original_;
  EdgeChoice follows_;
  Edges edges_;
  FlatFacets facets_;                 ///< of `target_.mesh`, if edges are followed
  FeatureSizes features_;             ///< of the target, in normalized coordinates
  std::vector<double> sizes_;         ///< of the present mesh's cells (`SizedMesh`)
  TrialStart start_, best_start_;     ///< of the present trial, and of the best one
  std::optional<EdgeLayout> layout_;  ///< of mesh_, or of its cage; none: it follows no edges
  LevelLayout level_layout_;          ///< of mesh_, from layout_
  std::vector<AutomaticAttempt> skipped_;  ///< their grids were too coarse for many edges
  std::string refusal_;                    ///< why there was no template for the last attempt that had none
  std::optional<SurfaceDiagnosis> diagnosis_;  ///< of the target; none: no attempt has been without a template
  std::optional<AutoTemplate> finest_;         ///< of the templates that were not refined, in the target's coordinates
  double aligned_share_ = 0;          ///< of the target's area on planes of the last grid through planes
};

void AutomaticFit::find_edges() {
  if (!follows_.any()) return;
  edges_.mesh = {target_.surface.positions(), target_.surface.triangles()};
  constexpr double kNone = 180;  // no edge is sharper
  std::vector<std::array<Index, 2>> borders;
  if (options_.keeps_groups) borders = group_borders(edges_.mesh, original_);
  const double angle = follows_.sharp ? *options_.crease_angle_degrees : kNone;
  edges_.features = signed_features(edges_.mesh, feature_curves(edges_.mesh, angle, borders));
  facets_ = flat_facets(target_.mesh);
}

/// Finds the features that are so small that a distance within the tolerance may be too large there. Those that are
/// smaller than the mean distance that is aimed at are faults of the surface.
void AutomaticFit::find_features() {
  target_.sample(0);
  const double most = options_.max_tolerance_percent / 100 / kAutomaticFeatureShare;
  features_ =
      feature_sizes(target_.surface, *target_.tree, std::min(options_.mean_tolerance_percent / 100, most / 2), most);
}

/// Returns nothing if there is no such template (`no_template_` then says so), or if the fit must end.
std::optional<AutoTemplate> AutomaticFit::make_template(AutoTemplateOptions options) {
  options.progress = begin_template();
  AutoTemplateResult made = auto_templates(original_, options, 1);
  result_.topology = made.wanted;
  if (!made.cancelled && made.templates.empty() && !diagnosis_)
    diagnosis_ = diagnose(original_, [this] { return runner_.is_to_end(); });
  if (made.cancelled || (diagnosis_ && diagnosis_->is_cancelled)) {
    note_end_in_template();
    return std::nullopt;
  }
  if (made.templates.empty()) {
    no_template_ = "target: " + why_no_grid(*diagnosis_, options.cells, made.wanted) + "; give a --template";
    return std::nullopt;
  }
  target_.normalization.take_in(made.templates.front().mesh);
  return std::move(made.templates.front());
}

/// Makes a pillowed template of at most so many cells; if there is none, the smallest that was found. Returns nothing
/// as `make_template`.
std::optional<AutoTemplate> AutomaticFit::make_template_of_at_most(std::size_t cells) {
  constexpr int kTries = 3;
  constexpr double kLess = 0.97;
  double asked = kRoomForTemplates * static_cast<double>(cells);
  std::optional<AutoTemplate> smallest;
  for (int trial = 1;; ++trial) {
    const auto count = std::clamp(static_cast<std::size_t>(asked), kLeastTemplateCells, kMostTemplateCells);
    std::optional<AutoTemplate> made = make_template({.cells = count, .pillow = true});
    if (!made) {
      if (no_template_.empty() || !smallest) return std::nullopt;
      no_template_.clear();
      return smallest;
    }
    const std::size_t got = made->mesh.num_cells();
    if (!smallest || got < smallest->mesh.num_cells()) smallest = std::move(made);
    if (got <= cells || count == kLeastTemplateCells || trial == kTries) return smallest;
    asked *= kLess * static_cast<double>(cells) / static_cast<double>(got);
  }
}

/// Makes the present mesh, with the tags that its subdivision surface needs, a cage.
void AutomaticFit::begin_cage() {
  if (layout_) layout_->creases.keep_from_folding(mesh_);
  AutomaticDriver::begin_cage();
  if (!layout_) return;
  level_layout_ = {cage_->groups_of_parts(layout_->group_of_face), cage_->caps_of_parts(layout_->caps),
                   layout_->creases};
  level_layout_.creases.refine(cage_->level().parent_creases);
}

/// Fits the present mesh. portion: of the attempt's remaining work. Returns false if the fit must end.
bool AutomaticFit::fit_level(int level, const QualitySchedule& schedule, const char* what, double portion) {
  begin_part(portion, schedule.expected_steps());
  const MeshTopology topology(mesh_);
  const std::vector<double> sizes = cage_ ? cage_->of_children(sizes_) : sizes_;
  std::vector<Vec3> lengths = wanted_lengths(topology, sizes, mesh_.num_cells(), target_.surface.area());
  if (!cage_ && sizes.empty()) keep_flat_cells(start_.grid.mesh, mesh_, QualityWeights{}.least_edge, lengths);
  const LevelSamples samples = cage_ ? samples_of(*cage_) : samples_of(mesh_);
  sample_target(topology.boundary_faces().size());
  QualityBoundary boundary{
      .samples = samples.positions, .triangles = samples.triangles, .triangle_faces = samples.faces};
  std::function<CreaseEnergy(double)> creases;
  if (layout_) {
    boundary.group_of_face = level_layout_.group_of_face;
    boundary.group_of_triangle = layout_->group_of_triangle;
    if (!mesh_.tags.creases.empty())
      creases = [&](double width) {
        CreaseEnergy energy = level_layout_.creases.energy(samples.crease_edges, samples.positions.num_rows(), width,
                                                           kQualityTangentialWeight);
        const VolumeMesh& of_unknowns = cage_ ? cage_->cage : mesh_;
        if (!sizes_.empty())
          energy.weigh(crease_factors(of_unknowns, MeshTopology(of_unknowns), sizes_, samples.positions));
        return energy;
      };
  }
  const bool going = run_stages(boundary, lengths, creases, level, schedule, what, [&](QualityStages& stages) {
    const std::span<const EdgeCap> edges =
        layout_ ? std::span<const EdgeCap>(level_layout_.caps.edges) : std::span<const EdgeCap>();
    const double least_edge = cage_ ? 0 : least_edge_share(start_.grid.mesh, lengths);
    stages.energy().forbid_folds(edges, least_edge);
    QualityCaps caps = layout_ ? level_layout_.caps : QualityCaps();
    add_caps_between_sizes(mesh_, sizes, caps);
    stages.energy().set_caps(caps.edges, caps.vertices);
  });
  start_.far = state_.far_cells;
  start_.poor = state_.cells.poor;
  return going;
}

/// Returns the largest miss of the target's small features by a surface, in the target's unit and coordinates.
std::optional<FeatureMiss> AutomaticFit::feature_miss(const TriangleMesh& surface) const {
  std::optional<FeatureMiss> miss = largest_feature_miss(features_, ClosestPoint(surface));
  if (!miss) return miss;
  miss->place = target_.normalization.from_unit({miss->place})[0];
  miss->size_percent = 100 * miss->size;
  miss->distance *= target_.normalization.diagonal;
  miss->size *= target_.normalization.diagonal;
  return miss;
}

/// Returns how well edges of the present mesh follow those of the target; nothing if there are none to follow.
std::optional<CreaseDistance> AutomaticFit::distance_of_edges() const {
  if (edges_.features.curves.empty()) return std::nullopt;
  if (cage_ && layout_)
    return level_layout_.creases.distance(cage_->limit().crease_edges, cage_->limit_surface().positions, 1,
                                          &edges_.features.curves);
  if (!layout_) return crease_distance(edges_.features.curves, mesh_.positions, {}, 1);
  return crease_distance(edges_.features.curves, mesh_.positions, layout_->segments, 1, &layout_->creases.curves());
}

/// Returns the curves that the present mesh does not follow: all of them if it follows none.
std::vector<UnfollowedCurve> AutomaticFit::unfollowed_curves() const {
  if (layout_) return layout_->routing.unfollowed;
  std::vector<UnfollowedCurve> all;
  const std::vector<FeatureCurve>& curves = edges_.features.curves.curves;
  for (std::size_t c = 0; c < curves.size(); ++c) {
    const ArcLength arc(curves[c].points);
    all.push_back(
        {static_cast<Index>(c), NotFollowed::excluded, arc.at(arc.length() / 2), curves[c].points, arc.length()});
  }
  return all;
}

/// Makes flat faces of the present mesh exactly so, measures it and keeps it if it is the best. Returns false if the
/// fit must end.
bool AutomaticFit::judge(AutomaticFitTrial trial) {
  if (options_.makes_cage && !cage_) begin_cage();  // the fit ended before it came to that
  // Flattening a relaxed place could make its faces meet again. The rest of that mesh is flat from the trial before.
  if (follows_.any() && !trial.relaxed_at) {
    flatten_faces(cage_ ? cage_->cage : mesh_, target_.mesh, *target_.tree, facets_);
    follow_cage();
  }
  const QualityReport quality = measure_quality(mesh_);
  // The stages ask for less between cells of two sizes; a trial without such cells is better.
  for (const Index c : cells_between_sizes(sizes_))
    state_.cells.least_share = std::min(state_.cells.least_share, quality.cell_minima[c] / options_.quality);
  const TriangleMesh surface = refined_triangles(boundary_surface(mesh_, MeshTopology(mesh_)));
  trial.mean_percent = trial.max_percent = 0;  // the trial may have those of another state
  const auto measure = [&](const TriangleMesh& fitted) {
    const SurfaceDistance distance = target_.distance(fitted);
    trial.mean_percent = std::max(trial.mean_percent, 100 * distance.mean());
    trial.max_percent = std::max(trial.max_percent, 100 * distance.max());
  };
  measure(surface);
  if (cage_) measure(cage_->limit_surface());
  trial.feature_miss = feature_miss(surface);
  trial.solid_volume_percent = volume_difference_percent(surface, target_.surface);
  trial.self_intersections = runner_.intersecting_pairs(surface, result_.report);
  const bool going = trial.self_intersections.has_value();
  const std::vector<UnfollowedCurve> unfollowed = unfollowed_curves();
  if (!keep_if_best(std::move(trial), quality, distance_of_edges(), unfollowed)) return going;
  start_.lost.clear();
  for (const UnfollowedCurve& curve : unfollowed)
    if (curve.reason != NotFollowed::too_acute) start_.lost.push_back(curve.points);
  best_start_ = start_;
  return going;
}

/// Fits a pillowed template. Returns false if the fit must end.
bool AutomaticFit::run_smooth(const AutomaticAttempt& attempt) {
  cage_.reset();
  std::optional<AutoTemplate> made = make_template_of_at_most(attempt.template_cells);
  if (!made) return !no_template_.empty();
  const std::size_t cells = made->mesh.num_cells();
  if (attempt.precedes_unrefined && cells > attempt.template_cells) return true;
  // Only a fine grid may have the topology; its cells need not be cut.
  const bool is_fine = !options_.makes_cage && cells > cells_after(attempt.template_cells, attempt.levels);
  const int levels = is_fine ? 0 : attempt.levels;
  mesh_ = made->mesh;
  sizes_.clear();
  start_ = {};
  if (levels == 0) finest_ = std::move(made);
  return fit_and_refine(levels);
}

/// Returns how poor each cell of the present mesh, or of its cage, is, 0 for good ones.
std::vector<double> AutomaticFit::faults_of_cells() const {
  constexpr double kMeets = 1;
  std::vector<double> faults;
  for (const double least : measure_quality(mesh_).cell_minima)
    faults.push_back(std::max(0.0, kAcceptableQuality - least));
  for (const Index c : cells_that_meet(mesh_)) faults[c] += kMeets;
  return cage_ ? cage_->sums_of_parts(faults) : faults;
}

/// Brings a grid near the target and lays out the edges on it. Returns false if the fit must end.
bool AutomaticFit::fit_smoothly(SizedMesh grid, AutomaticAttempt::Kind kind) {
  layout_.reset();
  cage_.reset();
  mesh_ = grid.mesh;
  sizes_ = grid.sizes;
  start_ = {.kind = kind, .grid = std::move(grid)};
  if (!fit_level(0, smooth_quality_schedule(), ", smooth", kSmoothPortion)) return false;
  start_.fitted = mesh_.positions;
  lay_out({});
  return true;
}

/// Routes the edges on the grid that was brought near the target.
void AutomaticFit::lay_out(RoutingOptions routing) {
  routing.cancelled = [this] { return runner_.is_to_end(); };
  routing.sizes = vertex_sizes(start_.grid.mesh, start_.grid.sizes);
  layout_ = edge_layout(start_.grid.mesh, start_.fitted, edges_.mesh, edges_.features, routing);
  cage_.reset();
  mesh_ = layout_->tagged_mesh;
  level_layout_ = {layout_->group_of_face, layout_->caps, layout_->creases};
  sizes_ = padded_sizes(mesh_, start_.grid.sizes);
}

/// Brings the present layout near the target, to be a cage, then others while edges have to be given up. The mesh that
/// the cage is subdivided to would tell the same, but has eight times as many cells. Returns false if the fit must end.
bool AutomaticFit::fit_future_cage(RoutingOptions& routing) {
  double least_faults = std::numeric_limits<double>::infinity();
  for (int round = 0; round < kMostRoutings; ++round) {
    if (round > 0) lay_out(routing);
    if (!fit_level(0, coarse_quality_schedule(options_.quality), ", edges", kCoarsePortion)) return false;
    const std::vector<double> faults = faults_of_cells();
    const double sum = std::accumulate(faults.begin(), faults.end(), 0.0);
    if (sum >= least_faults) break;  // what was given up has not helped
    least_faults = sum;
    if (round + 1 == kMostRoutings) break;  // the layout must be that of the routing's options
    if (!give_up_poor_curves(layout_->patched, edges_.features, layout_->routing, faults, routing)) break;
  }
  return true;
}

/// Fits the present layout, then others while edges have to be given up. Returns false if the fit must end.
bool AutomaticFit::route_and_fit(const AutomaticFitTrial& described) {
  RoutingOptions routing;
  double least_merit = std::numeric_limits<double>::infinity();
  for (int round = 0; round < kMostRoutings; ++round) {
    if (round > 0) lay_out(routing);
    AutomaticFitTrial trial = described;
    if (options_.makes_cage && !fit_future_cage(routing)) {
      if (result_.trials.empty()) judge(std::move(trial));
      return false;
    }
    trial.pads = layout_->pads.pads.size();
    if (!fit_edges(trial, kRoutingPortion)) return false;
    const double merit = result_.trials.back().merit;
    const std::vector<double> faults = faults_of_cells();
    if (!relax_last_trial()) return false;
    if (merit >= least_merit) break;  // what was given up has not helped
    least_merit = merit;
    if (!give_up_poor_curves(layout_->patched, edges_.features, layout_->routing, faults, routing)) break;
  }
  return true;
}

/// Fits a padded grid. Returns false if the fit must end.
bool AutomaticFit::run_edges(const AutomaticAttempt& attempt) {
  constexpr double kRoomForPads = 0.5, kLess = 0.95;
  constexpr double kEnough = 0.8;  // share of the edges that must find a path, or a finer grid is worth more than a fit
  constexpr int kTries = 3;
  double asked = kRoomForPads * static_cast<double>(attempt.template_cells);
  for (int trial = 1;; ++trial) {
    const auto count = std::clamp(static_cast<std::size_t>(asked), kLeastTemplateCells, kMostTemplateCells);
    std::optional<AutoTemplate> made =
        make_template({.cells = count, .through_planes = attempt.kind == AutomaticAttempt::Kind::aligned});
    if (!made) return !no_template_.empty();
    if (attempt.kind == AutomaticAttempt::Kind::aligned) aligned_share_ = made->aligned_share;
    const AutomaticFitTrial described{.template_cells = made->mesh.num_cells(),
                                      .through_planes = attempt.kind == AutomaticAttempt::Kind::aligned};
    if (!fit_smoothly({std::move(made->mesh), {}}, attempt.kind)) {
      if (result_.trials.empty()) judge(described);
      return false;
    }
    const std::size_t padded = layout_->patched.mesh.num_cells();
    if (padded > attempt.template_cells && options_.cells && trial < kTries && count > kLeastTemplateCells) {
      asked *= kLess * static_cast<double>(attempt.template_cells) / static_cast<double>(padded);
      continue;
    }
    if (!attempt.is_last_count && routed_share(layout_->routing, edges_.features.curves) < kEnough) {
      skipped_.push_back(attempt);
      return true;
    }
    return route_and_fit(described);
  }
}

/// Returns the cells at which the best trial is not as good as aimed at: of its grid if it follows edges, of its mesh
/// if not. First those whose faces meet others, then the poor ones, the worst first, then those too far from the
/// target, then those at edges without a path, the longest first, then those at small features.
std::vector<Fault> AutomaticFit::faults_of_best() const {
  std::vector<Fault> faults;
  if (best().self_intersections != std::size_t{0})
    for (const Index c : cells_that_meet(result_.mesh)) faults.push_back({c});
  const std::vector<double> least = measure_quality(result_.mesh).cell_minima;
  std::vector<Index> poor = best_start_.poor;
  std::ranges::stable_sort(poor, std::less{}, [&](Index c) { return least[c]; });
  for (const Index c : poor)
    if (least[c] < kEnoughQuality * options_.quality) faults.push_back({c});
  for (const Index c : best_start_.far) faults.push_back({c});
  if (best_start_.kind == AutomaticAttempt::Kind::smooth) return faults;
  const VolumeMesh& grid = best_start_.grid.mesh;
  for (Fault& fault : faults) fault = cells_at(grid, best_start_.fitted, result_.mesh, fault);
  const BoundaryCells cells(grid, best_start_.fitted);
  std::vector<std::vector<Vec3>> lost = best_start_.lost;
  std::ranges::stable_sort(lost, std::greater{}, [](const std::vector<Vec3>& curve) { return polyline_length(curve); });
  const double spacing = std::sqrt(target_.surface.area() / static_cast<double>(grid.num_cells()));
  for (const std::vector<Vec3>& curve : lost) faults.push_back(cells.near(sampled_polyline(curve, spacing)));
  const TriangleMesh surface = refined_triangles(boundary_surface(result_.mesh, MeshTopology(result_.mesh)));
  faults.push_back(cells.near(missed_feature_points(features_, ClosestPoint(surface), kAutomaticFeatureShare)));
  return faults;
}

/// Fits a template whose cells are smaller where the best trial is not as good as aimed at: where the target is missed,
/// and at cells that meet or are poor. Returns false if the fit must end.
bool AutomaticFit::run_graded() {
  constexpr double kShareOfGrid = 0.6;  // of the cells allowed; the others are left for the small ones
  const std::size_t most = options_.cells.value_or(static_cast<std::size_t>(most_refined_cells()));
  if (!finest_ || static_cast<double>(finest_->mesh.num_cells()) > kMostShareOfGrid * static_cast<double>(most)) {
    const auto cells = static_cast<std::size_t>(kShareOfGrid * static_cast<double>(most));
    finest_ = make_template({.cells = std::clamp(cells, kLeastTemplateCells, kMostTemplateCells), .pillow = true});
    if (!finest_) return !no_template_.empty();
  }
  target_.sample(0);
  const ClosestPoint fitted(refined_triangles(boundary_surface(result_.mesh, MeshTopology(result_.mesh))));
  std::vector<Vec3> places = missed_points(target_.surface, fitted, options_.max_tolerance_percent / 100);
  for (const Fault& fault : faults_of_best())
    for (const Index c : fault) places.push_back(cell_center(result_.mesh, result_.mesh.positions, c));
  SearchStop stop([this] { return !runner_.is_to_end(); });
  std::optional<SizedMesh> graded = graded_template(solid_boundary(original_).surface, finest_->grid, finest_->kept,
                                                    target_.normalization.from_unit(std::move(places)), most, stop);
  if (!graded) return !stop.is_stopped();
  target_.normalization.take_in(graded->mesh);
  layout_.reset();
  cage_.reset();
  mesh_ = std::move(graded->mesh);
  sizes_ = graded->sizes;
  start_ = {.grid = {{}, std::move(graded->sizes)}};
  AutomaticFitTrial trial{.template_cells = finest_->mesh.num_cells(), .refined_cells = mesh_.num_cells()};
  return fit_level(0, aiming_at_distance(single_quality_schedule(options_.quality)), ", graded") && judge(trial) &&
         relax_last_trial();
}

/// Cuts the cells at which the best trial is not as good as aimed at, and fits the result. Returns false if the fit
/// must end.
bool AutomaticFit::run_refined() {
  const AutomaticFitTrial before = best();
  const bool is_smooth = best_start_.kind == AutomaticAttempt::Kind::smooth;
  const VolumeMesh& base = is_smooth ? result_.mesh : best_start_.grid.mesh;
  const double most_cells =
      options_.cells ? static_cast<double>(*options_.cells) : kMostGrowth * static_cast<double>(before.cells);
  const double room = most_cells * static_cast<double>(base.num_cells()) / static_cast<double>(before.cells);
  std::optional<SizedMesh> refined =
      refined_at_faults(base, best_start_.grid.sizes, faults_of_best(), static_cast<std::size_t>(room));
  if (!refined) return true;
  AutomaticFitTrial trial{.template_cells = before.template_cells,
                          .through_planes = before.through_planes,
                          .refined_cells = refined->mesh.num_cells(),
                          .level = before.level};
  if (!is_smooth) {
    if (!fit_smoothly(std::move(*refined), best_start_.kind)) return false;
    if (options_.cells && mesh_.num_cells() > *options_.cells) return true;  // its pads took more room than before
    return route_and_fit(trial);
  }
  layout_.reset();
  mesh_ = std::move(refined->mesh);
  sizes_ = refined->sizes;
  start_ = {.grid = {{}, std::move(refined->sizes)}};
  return fit_level(trial.level, aiming_at_distance(fine_quality_schedule(options_.quality)), ", refined") &&
         judge(trial) && relax_last_trial();
}

/// Returns false if the fit must end.
bool AutomaticFit::run_attempt(const AutomaticAttempt& attempt) {
  layout_.reset();
  no_template_.clear();
  const bool going = attempt.kind == AutomaticAttempt::Kind::smooth ? run_smooth(attempt) : run_edges(attempt);
  if (!no_template_.empty()) refusal_ = no_template_;
  return going;
}

/// Makes the best trial the present one, to go on from, if it is another one and follows no edges.
void AutomaticFit::take_best() {
  if (is_present_best() || !is_strict() || best_start_.kind != AutomaticAttempt::Kind::smooth) return;
  layout_.reset();
  mesh_ = result_.mesh;
  sizes_ = best_start_.grid.sizes;
  start_ = best_start_;
  take_states();
}

AutomaticFitResult AutomaticFit::run() {
  find_edges();
  find_features();
  const std::vector<AutomaticAttempt> attempts = attempts_of(options_, !edges_.features.curves.empty());
  bool going = true;
  for (std::size_t i = 0; i < attempts.size() && going && !ends_search(); ++i) {
    if (is_worth_trying(attempts[i])) {
      begin_attempt(attempts[i].portion);
      going = run_attempt(attempts[i]);
    }
    if (going && is_strict() && is_good() && meets_distances(best(), options_)) going = polish();
    if (going && result_.trials.empty() && diagnosis_ &&
        is_too_thin_for_grids(*diagnosis_, attempts.back().template_cells))
      throw InputError(refusal_);
  }
  for (AutomaticAttempt attempt : std::exchange(skipped_, {})) {
    if (!going || !result_.trials.empty()) break;
    attempt.is_last_count = true;
    going = run_attempt(attempt);
  }
  if (going && result_.trials.empty()) throw InputError(refusal_);
  if (going && !follows_.any() && is_worth_refining()) {
    begin_attempt();
    going = run_graded();
  }
  const int most_refinements = edges_.features.curves.empty() ? kMostRefinements : kMostRefinementsWithEdges;
  for (int round = 0; going && is_worth_refining() && round < most_refinements; ++round) {
    const std::size_t before = result_.chosen;
    begin_attempt();
    going = run_refined();
    if (result_.chosen == before) break;
  }
  if (going && !edges_.features.curves.empty() && !is_valid(best())) {
    begin_attempt();
    going =
        run_attempt({AutomaticAttempt::Kind::smooth, options_.cells.value_or(kAutomaticCells.back()) / kChildren, 1});
  }
  if (going) {
    take_best();
    going = polish();
  }
  if (going) conclude_fit(result_, options_);
  return finish();
}

}  // namespace

AutomaticFitResult fit_automatically(const TriangleMesh& given, const AutomaticFitOptions& options) {
  const TriangleMesh target = joined_at_open_edges(given);
  if (const std::optional<RegionSurface> regions = find_regions(target, options.regions)) {
    if (options.makes_cage)
      throw InputError(
          "AutomaticFitOptions::makes_cage: the target has several regions; give a template with these to "
          "fit_subdivision_volume");
    return fit_regions(*regions, options);
  }
  const AutomaticFitOptions checked = checked_options(options);
  const bool follows_sharp = has_edges_to_follow(target, checked.crease_angle_degrees, checked.follows_all_edges);
  const auto fit = [&](bool follows_borders, const AutomaticFitOptions& given) {
    const EdgeChoice follows{follows_sharp, follows_borders};
    if (!follows.any()) return AutomaticFit(target, follows, given).run();
    return AutomaticFit(solid_boundary(target).surface, follows, given).run();
  };
  const bool may_follow_borders = checked.crease_angle_degrees && !options.keeps_groups && !options.makes_cage &&
                                  has_smooth_borders(target, *checked.crease_angle_degrees);
  if (may_follow_borders) return fit_for_groups(target, options, fit);
  return fit(options.keeps_groups && !group_borders(target, target).empty(), options);
}

}  // namespace subvol
