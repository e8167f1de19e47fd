// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/automatic_solid_driver.h"

#include "subvol/base/sort_unique.h"
#include "subvol/fit/features/signed_features.h"
#include "subvol/fit/fits/flat_faces.h"
#include "subvol/fit/fits/level_samples.h"
#include "subvol/fit/geometry/boundary_triangles.h"
#include "subvol/fit/geometry/closest_point.h"
#include "subvol/fit/mending/surface_repair.h"
#include "subvol/fit/quality/quality.h"
#include "subvol/fit/stages/quality_stages.h"
#include "subvol/mesh/mesh_topology.h"
#include "subvol/surface/boundary.h"

#include <algorithm>
#include <array>
#include <functional>
#include <span>
#include <utility>

namespace subvol::internal {

namespace {

constexpr double kRoomForTemplates = 0.85;  // share of the cells allowed that a template is asked for first

}  // namespace

void AutomaticSolidDriver::find_edges() {
  if (!follows_.any()) return;
  edges_.mesh = {target_.surface.positions(), target_.surface.triangles()};
  std::vector<std::array<Index, 2>> borders;
  if (options_.keeps_groups) borders = group_borders(edges_.mesh, original_);
  const double angle = follows_.sharp ? *options_.crease_angle_degrees : kNoCreaseAngle;
  edges_.features = signed_features(edges_.mesh, feature_curves(edges_.mesh, angle, borders));
  facets_ = flat_facets(target_.mesh);
}

void AutomaticSolidDriver::find_features() {
  // Larger targets are not sampled more densely. Their features may be missed if they are smaller than the spacing of
  // so many samples, 0.2 % of the root of the area.
  constexpr std::size_t kMostFeatureSamples = 200'000;
  target_.sample(0, static_cast<std::size_t>(options_.tuning.fitting.least_target_samples), kMostFeatureSamples);
  const double most = options_.max_tolerance_percent / 100 / kAutomaticFeatureShare;
  features_ = feature_sizes(target_.surface, *target_.tree, std::min(options_.mean_tolerance_percent / 100, most / 2),
                            most, [this] { return runner_.is_to_end(); });
}

const SolidBoundary& AutomaticSolidDriver::solid() {
  if (!solid_) solid_ = solid_boundary(original_);
  return *solid_;
}

std::optional<AutoTemplate> AutomaticSolidDriver::make_template(AutoTemplateOptions options) {
  options.progress = begin_template();
  AutoTemplateResult made = auto_templates(solid(), options, 1);
  result_.topology = made.wanted;
  if (!made.cancelled && made.templates.empty() && !diagnosis_)
    diagnosis_ = diagnose(original_, [this] { return runner_.is_to_end(); });
  if (made.cancelled || (diagnosis_ && diagnosis_->is_cancelled)) {
    note_end_in("the template");
    return std::nullopt;
  }
  if (made.templates.empty()) {
    no_template_ = "target: " + why_no_grid(*diagnosis_, options.cells, made.wanted) + "; give a --template";
    return std::nullopt;
  }
  target_.normalization.take_in(made.templates.front().mesh);
  return std::move(made.templates.front());
}

std::optional<AutoTemplate> AutomaticSolidDriver::make_template_of_at_most(std::size_t cells) {
  constexpr int kTries = 3;                     // grids
  constexpr double kRetryTemplateShare = 0.97;  // after a grid that was too large, share of what would have fitted
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
    asked *= kRetryTemplateShare * static_cast<double>(cells) / static_cast<double>(got);
  }
}

void AutomaticSolidDriver::begin_cage() {
  if (layout_) layout_->creases.keep_from_folding(mesh_);
  AutomaticDriver::begin_cage();
  if (!layout_) return;
  level_layout_ = {cage_->groups_of_parts(layout_->group_of_face), cage_->caps_of_parts(layout_->caps),
                   layout_->creases};
  level_layout_.creases.refine(cage_->level().parent_creases);
}

bool AutomaticSolidDriver::fit_level(int level, const QualitySchedule& schedule, const char* what, double portion) {
  begin_part(portion, schedule.expected_steps());
  const MeshTopology topology(mesh_);
  const std::vector<double> sizes = cage_ ? cage_->of_children(sizes_) : sizes_;
  std::vector<Vec3> lengths = wanted_lengths(topology, sizes, mesh_.num_cells(), target_.surface.area());
  if (!cage_ && sizes.empty()) keep_flat_cells(start_.grid, mesh_, QualityWeights{}.least_edge, lengths);
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
        return level_layout_.creases.energy(samples.crease_edges, samples.positions.num_rows(), width,
                                            options_.tuning.quality.tangential_weight);
      };
  }
  const bool going = run_stages(boundary, lengths, creases, level, schedule, what, [&](QualityStages& stages) {
    const std::span<const EdgeCap> edges =
        layout_ ? std::span<const EdgeCap>(level_layout_.caps.edges) : std::span<const EdgeCap>();
    const double least_edge = cage_ ? 0 : least_edge_share(start_.grid, lengths);
    stages.energy().forbid_folds(edges, least_edge);
    QualityCaps caps = layout_ ? level_layout_.caps : QualityCaps();
    add_caps_between_sizes(mesh_, sizes, caps);
    stages.energy().set_caps(caps.edges, caps.vertices);
  });
  start_.far = state_.far_cells;
  start_.poor = state_.cells.poor;
  return going;
}

void AutomaticSolidDriver::measure_features(const ClosestPoint& surface, AutomaticFitTrial& trial) const {
  const std::vector<double> distances = feature_distances(features_, surface);
  const auto largest_miss = [&](double least_size) {
    std::optional<FeatureMiss> miss = largest_feature_miss(features_, distances, least_size);
    if (!miss) return miss;
    miss->place = target_.normalization.from_unit({miss->place})[0];
    miss->distance *= target_.normalization.diagonal;
    miss->size *= target_.normalization.diagonal;
    return miss;
  };
  trial.feature_miss = largest_miss(0);
  trial.lost_feature = largest_miss(kLostFeaturePercent / 100);
  if (trial.lost_feature && trial.lost_feature->share <= 1) trial.lost_feature.reset();
}

std::optional<CreaseDistance> AutomaticSolidDriver::distance_of_edges() const {
  if (edges_.features.curves.empty()) return std::nullopt;
  if (cage_ && layout_)
    return level_layout_.creases.distance(cage_->limit().crease_edges, cage_->limit_surface().positions, 1,
                                          &edges_.features.curves);
  if (!layout_) return crease_distance(edges_.features.curves, mesh_.positions, {}, 1);
  return crease_distance(edges_.features.curves, mesh_.positions, layout_->segments, 1, &layout_->creases.curves());
}

std::vector<UnfollowedCurve> AutomaticSolidDriver::unfollowed_curves() const {
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

bool AutomaticSolidDriver::judge(AutomaticFitTrial trial) {
  if (options_.makes_cage && !cage_) {  // the fit ended before it came to that
    begin_cage();
    ++trial.level;
  }
  // Flattening a relaxed place could make its faces meet again. The rest of that mesh is flat from the trial before.
  if (follows_.any() && !trial.relaxed_at) {
    if (cage_)
      flatten_faces(*cage_, target_.mesh, *target_.tree, facets_);
    else
      flatten_faces(mesh_, target_.mesh, *target_.tree, facets_);
    follow_cage();
  }
  const QualityReport quality = measure_quality(mesh_);
  // The stages ask for less between cells of two sizes; a trial without such cells is better.
  for (const Index c : cells_between_sizes(sizes_))
    state_.cells.least_share = std::min(state_.cells.least_share, quality.cell_minima[c] / options_.quality);
  const TriangleMesh surface = refined_triangles(boundary_surface(mesh_, MeshTopology(mesh_)));
  trial.mean_percent = trial.max_percent = 0;  // the trial may have those of another state
  const ClosestPoint surface_tree(surface);
  const auto measure = [&](const TriangleMesh& fitted, const ClosestPoint& tree) {
    const SurfaceDistance distance = target_.distance(fitted, tree);
    trial.mean_percent = std::max(trial.mean_percent, 100 * distance.mean());
    trial.max_percent = std::max(trial.max_percent, 100 * distance.max());
  };
  measure(surface, surface_tree);
  if (cage_) {
    const TriangleMesh limit = cage_->limit_surface();
    measure(limit, ClosestPoint(limit));
  }
  measure_features(surface_tree, trial);
  trial.solid_volume_percent = volume_difference_percent(surface, target_.surface);
  trial.self_intersections = runner_.intersecting_pairs(surface, result_.report);
  const bool going = trial.self_intersections.has_value();
  const std::vector<UnfollowedCurve> unfollowed = unfollowed_curves();
  if (keep_if_best(std::move(trial), quality, distance_of_edges(), unfollowed)) best_start_ = start_;
  return going;
}

std::vector<double> AutomaticSolidDriver::faults_of_cells(bool may_meet) const {
  constexpr double kMeetingCellFault = 1;  // a cell that meets another one is worse than any cell of poor quality
  std::vector<double> faults;
  for (const double least : measure_quality(mesh_).cell_minima)
    faults.push_back(std::max(0.0, options_.tuning.automatic.acceptable_quality - least));
  if (may_meet)
    for (const Index c : cells_that_meet(mesh_)) faults[c] += kMeetingCellFault;
  return cage_ ? cage_->sums_of_parts(faults) : faults;
}

bool AutomaticSolidDriver::fit_smoothly(VolumeMesh grid, AutomaticAttempt::Kind kind) {
  layout_.reset();
  cage_.reset();
  mesh_ = grid;
  begin_mesh();
  sizes_.clear();
  start_ = {.kind = kind, .grid = std::move(grid)};
  if (!fit_level(0, smooth_quality_schedule(), ", smooth", kSmoothPortion)) return false;
  start_.fitted = mesh_.positions;
  start_.stages = stages();
  lay_out({});
  return true;
}

void AutomaticSolidDriver::lay_out(RoutingOptions routing) {
  routing.cancelled = [this] { return runner_.is_to_end(); };
  layout_ = edge_layout(start_.grid, start_.fitted, edges_.mesh, edges_.features, routing, options_.tuning.quality);
  cage_.reset();
  mesh_ = layout_->tagged_mesh;
  sizes_.clear();
  begin_mesh(start_.stages);
  level_layout_ = {layout_->group_of_face, layout_->caps, layout_->creases};
}

std::vector<Fault> AutomaticSolidDriver::faults_of_best() const {
  std::vector<Fault> faults;
  if (meets_itself(best())) {
    std::vector<Index> meeting = cells_that_meet(result_.mesh);
    sort_unique(meeting);
    for (const Index c : meeting) faults.push_back({c});
  }
  const std::vector<double> least = measure_quality(result_.mesh).cell_minima;
  std::vector<Index> poor = best_start_.poor;
  std::ranges::stable_sort(poor, std::less{}, [&](Index c) { return least[c]; });
  for (const Index c : poor)
    if (least[c] < options_.tuning.automatic.enough_quality * options_.quality) faults.push_back({c});
  for (const Index c : best_start_.far) faults.push_back({c});
  return faults;
}

}  // namespace subvol::internal
