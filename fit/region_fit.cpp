// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/base/error.h"
#include "subvol/base/format.h"
#include "subvol/fit/automatic_attempts.h"
#include "subvol/fit/automatic_driver.h"
#include "subvol/fit/automatic_fit.h"
#include "subvol/fit/features/crisp_edges.h"
#include "subvol/fit/features/feature_routing.h"
#include "subvol/fit/features/sheet_layout.h"
#include "subvol/fit/fits/flat_faces.h"
#include "subvol/fit/fits/level_samples.h"
#include "subvol/fit/fits/local_cells.h"
#include "subvol/fit/fits/region_volumes.h"
#include "subvol/fit/fits/smooth_refinement.h"
#include "subvol/fit/geometry/boundary_triangles.h"
#include "subvol/fit/geometry/closest_point.h"
#include "subvol/fit/quality/quality.h"
#include "subvol/fit/quality/region_quality.h"
#include "subvol/fit/stages/quality_stages.h"
#include "subvol/fit/target/fit_target.h"
#include "subvol/mesh/interfaces.h"
#include "subvol/mesh/mesh_topology.h"
#include "subvol/surface/boundary.h"
#include "subvol/surface/welded_surface.h"
#include "subvol/templates/auto_template.h"
#include "subvol/templates/pillow.h"
#include "subvol/templates/region_template.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace subvol {

using namespace internal;

namespace {

/// A grid is first asked for this share of the cells allowed, so that one that comes out larger still has room; after a
/// grid that was too large, the next is asked for a little less than would have fitted.
constexpr double kAskedShare = 0.85, kRetryShare = 0.95;
constexpr int kGridTries = 3;  // grids

RegionSurface normalized(RegionSurface surface, const Normalization& normalization) {
  surface.mesh.positions = normalization.to_unit(std::move(surface.mesh.positions));
  for (double& volume : surface.volumes) volume /= std::pow(normalization.diagonal, 3);
  return surface;
}

/// An automatic fit of several regions.
class RegionFit : AutomaticDriver {
 public:
  RegionFit(const RegionSurface& target, const AutomaticFitOptions& options)
      : AutomaticDriver(options, target),
        original_(target),
        unit_(normalized(target, target_.normalization)),
        tree_(unit_.mesh) {}
  AutomaticFitResult run();

 private:
  void find_curves();
  bool run_count(std::size_t cells);
  bool run_smooth(std::size_t cells);
  bool run_unrefined(std::size_t cells);
  bool make_pillowed(std::size_t most);
  bool run_curves(std::size_t cells);
  std::optional<VolumeMesh> make_grid(std::size_t cells);
  PillowChoice pillow_choice(const VolumeMesh& grid) const;
  bool is_exact(const VolumeMesh& grid) const;
  bool lies_on_target(std::span<const std::array<Index, 4>> faces, const VolumeMesh& grid) const;
  void begin_cage() override;
  bool fit_level(int level, const QualitySchedule& schedule, const char* what, double portion = 1) override;
  void group_by_pairs(QualityBoundary& boundary, const MeshTopology& topology) const;
  double volume_percent() const;
  void make_exact(bool is_relaxed);
  std::optional<CreaseDistance> distance_of_curves() const;
  /// Where sheets meet in curves, cells gain quality if the curves leave the planes of flat sheets: with the distance
  /// allowed as the aim, those of 19-wavy were 0.5 % of the diagonal off, with this one 0.02 %, at a least scaled
  /// Jacobian of 0.45 instead of 0.58.
  double aimed_max_percent() const override {
    constexpr double kMostFromPlanes = 0.1;  // percent of the diagonal
    return follows_edges_ ? std::min(kMostFromPlanes, options_.max_tolerance_percent) : options_.max_tolerance_percent;
  }
  bool judge(AutomaticFitTrial trial) override;
  void conclude();

  const RegionSurface& original_;
  RegionSurface unit_;  ///< the target in normalized coordinates
  ClosestPoint tree_;   ///< over all its triangles
  bool follows_edges_ = false;
  SheetCurves curves_;                 ///< to follow, if edges are followed
  std::optional<SheetLayout> layout_;  ///< of mesh_, or of its cage; none: sheets correspond as wholes
  FollowedCreases level_creases_;      ///< of mesh_, from layout_
  RegionTemplate template_;            ///< the last one, without its mesh
  double least_edge_ = 0;              ///< share of its wanted length that an edge must have on its grid
};

void RegionFit::find_curves() {
  const EdgeDecision edges = decide_about_edges(unit_.mesh, options_.crease_angle_degrees, options_.follows_all_edges);
  follows_edges_ = edges.follows;
  if (!edges.warning.empty()) result_.report.warnings.push_back(edges.warning);
  if (follows_edges_) curves_ = sheet_curves(unit_, options_.crease_angle_degrees);
}

/// Says where more than three regions, the outside among them, meet along an edge of the target; empty if nowhere does.
std::string crowded_curve(const RegionSurface& target) {
  constexpr std::size_t kMostRegionsAtEdge = 3;  // the outside among them
  std::string text;
  for_each_edge(sorted_half_edges(target.mesh.triangles, target.mesh.positions.size()),
                [&](std::span<const SurfaceHalfEdge> edge) {
                  if (!text.empty() || edge.size() <= kMostRegionsAtEdge) return;
                  std::set<int> regions;
                  for (const SurfaceHalfEdge& side : edge)
                    for (const int region : target.sides[static_cast<std::size_t>(side.triangle)])
                      regions.insert(region);
                  if (regions.size() <= kMostRegionsAtEdge) return;
                  const Vec3 middle = 0.5 * (target.mesh.positions[edge[0].low] + target.mesh.positions[edge[0].high]);
                  text = formatted(
                      "; %zu regions meet along a curve through (%g, %g, %g), which a grid can follow only "
                      "in planes between its cells",
                      regions.size(), middle.x(), middle.y(), middle.z());
                });
  return text;
}

/// Returns a labeled grid that has about so many cells once it is pillowed; nothing if there is none, or if the fit
/// must end.
std::optional<VolumeMesh> RegionFit::make_grid(std::size_t cells) {
  RegionTemplateOptions options;
  options.cells = std::clamp(cells, kLeastTemplateCells, kMostTemplateCells);
  options.for_pillow = true;
  options.progress = begin_template();
  RegionTemplateResult made = region_template(original_, options);
  if (made.cancelled) {
    note_end_in("the template");
    return std::nullopt;
  }
  if (!made.made) {
    std::string names;
    for (const Index r : made.missed) {
      const Group& region = original_.regions[static_cast<std::size_t>(r)];
      names +=
          (names.empty() ? "" : ", ") + (region.name.empty() ? "region " + std::to_string(region.number) : region.name);
    }
    no_template_ = "target: no grid that was tried, of up to 9 times " + std::to_string(options.cells) +
                   " cells, has the topology of its regions" + (names.empty() ? "" : "; missed: " + names) +
                   crowded_curve(original_) + "; ask for more --cells, or give a --template";
    return std::nullopt;
  }
  VolumeMesh mesh = std::move(made.made->mesh);
  template_ = std::move(*made.made);
  target_.normalization.take_in(mesh);
  least_edge_ =
      least_edge_share(mesh, wanted_lengths(MeshTopology(mesh), {}, mesh.num_cells(), target_.surface.area()));
  return mesh;
}

/// Returns true if faces of a grid lie on the target, up to rounding.
bool RegionFit::lies_on_target(std::span<const std::array<Index, 4>> faces, const VolumeMesh& grid) const {
  constexpr double kOnTargetRounding = 1e-7;  // of the diagonal
  for (const auto& face : faces) {
    Vec3 center = Vec3::Zero();
    for (const Index v : face) center += grid.positions[v] / 4;
    if (tree_.closest(center).distance > kOnTargetRounding) return false;
    for (const Index v : face)
      for (const Vec3& p : {grid.positions[v], Vec3(0.5 * (center + grid.positions[v]))})
        if (tree_.closest(p).distance > kOnTargetRounding) return false;
  }
  return true;
}

/// Returns the choice of the parts of regions' boundaries that do not lie on the grid's own faces.
PillowChoice RegionFit::pillow_choice(const VolumeMesh& grid) const {
  return [&](int, std::span<const std::array<Index, 4>> part) {
    // Layers that were added before leave the sheets on the grid's own vertices.
    return !lies_on_target(part, grid);
  };
}

/// Returns true if all sheets of a grid lie on the target.
bool RegionFit::is_exact(const VolumeMesh& grid) const {
  const MeshTopology topology(grid);
  std::vector<Index> sheets = find_interfaces(grid, topology).faces;
  sheets.insert(sheets.end(), topology.boundary_faces().begin(), topology.boundary_faces().end());
  std::vector<std::array<Index, 4>> faces(sheets.size());
  for (std::size_t i = 0; i < sheets.size(); ++i) std::ranges::copy(topology.face(sheets[i]), faces[i].begin());
  return lies_on_target(faces, grid);
}

void RegionFit::group_by_pairs(QualityBoundary& boundary, const MeshTopology& topology) const {
  const std::vector<std::array<int, 2>> pairs = region_pairs(unit_);
  const auto key_of = [&](const std::array<int, 2>& pair) {
    return static_cast<Index>(std::ranges::lower_bound(pairs, pair) - pairs.begin());
  };
  boundary.group_of_face.assign(topology.num_faces(), 0);
  for (const Index f : topology.boundary_faces())
    boundary.group_of_face[f] = key_of({kOutsideRegion, mesh_.references[topology.face_cells(f)[0]]});
  const Interfaces interfaces = find_interfaces(mesh_, topology);
  for (std::size_t i = 0; i < interfaces.faces.size(); ++i)
    boundary.group_of_face[interfaces.faces[i]] = key_of(interfaces.pairs[interfaces.pair_of_face[i]]);
  for (const Index t : target_.region_triangle)
    boundary.group_of_triangle.push_back(key_of(unit_.pair(static_cast<std::size_t>(t))));
}

void RegionFit::begin_cage() {
  (layout_ ? layout_->creases : FollowedCreases()).keep_from_folding(mesh_);
  AutomaticDriver::begin_cage();
  if (!layout_) return;
  level_creases_ = layout_->creases;
  level_creases_.refine(cage_->level().parent_creases);
}

/// Fits the present mesh. portion: of the attempt's remaining work. Returns false if the fit must end.
bool RegionFit::fit_level(int level, const QualitySchedule& schedule, const char* what, double portion) {
  begin_part(portion, schedule.expected_steps());
  const MeshTopology topology(mesh_);
  QualityBoundary boundary;
  boundary.interfaces = find_interfaces(mesh_, topology).faces;
  const std::size_t faces = topology.boundary_faces().size() + boundary.interfaces.size();
  const double h = std::sqrt(target_.surface.area() / static_cast<double>(faces));
  const std::vector<Vec3> lengths(mesh_.num_cells(), Vec3::Constant(h));
  const LevelSamples samples = cage_ ? samples_of(*cage_) : samples_of_sheets(mesh_);
  sample_target(faces);
  boundary.samples = samples.positions;
  boundary.triangles = samples.triangles;
  boundary.triangle_faces = samples.faces;
  std::function<CreaseEnergy(double)> creases;
  if (layout_) {
    boundary.group_of_face = cage_ ? cage_->groups_of_parts(layout_->group_of_face) : layout_->group_of_face;
    for (const Index t : target_.region_triangle) boundary.group_of_triangle.push_back(layout_->group_of_triangle[t]);
    if (!mesh_.tags.creases.empty())
      creases = [&](double width) {
        const FollowedCreases& followed = cage_ ? level_creases_ : layout_->creases;
        return followed.energy(samples.crease_edges, samples.positions.num_rows(), width,
                               options_.tuning.quality.tangential_weight);
      };
  } else {
    group_by_pairs(boundary, topology);
  }
  return run_stages(boundary, lengths, creases, level, schedule, what,
                    [this](QualityStages& stages) { stages.energy().forbid_folds({}, cage_ ? 0 : least_edge_); });
}

/// Returns the largest difference of a region's volume from the target's, in percent.
double RegionFit::volume_percent() const {
  const std::vector<double> volumes = region_volumes(mesh_);
  double largest = 0;
  for (std::size_t r = 0; r < volumes.size(); ++r)
    largest = std::max(largest, 100 * std::abs(volumes[r] / unit_.volumes[r] - 1));
  return largest;
}

/// Makes flat sheets of the present mesh exactly so, and gives its regions the volumes of the target's, unless cells
/// become too poor.
void RegionFit::make_exact(bool is_relaxed) {
  // A cell may become as poor, for what is exact.
  constexpr double kLeastAfterFlattening = 0.45, kLeastAfterVolumes = 0.3;
  const bool flattens = follows_edges_ && !is_relaxed;
  if (cage_) {
    if (flattens) flatten_sheets(*cage_, target_, kLeastAfterFlattening);
    restore_volumes(*cage_, unit_.volumes, kLeastAfterVolumes);
    follow_cage();
  } else {
    if (flattens) flatten_sheets(mesh_, target_, kLeastAfterFlattening);
    restore_volumes(mesh_, unit_.volumes, kLeastAfterVolumes);
  }
}

std::optional<CreaseDistance> RegionFit::distance_of_curves() const {
  if (!layout_ || curves_.features.curves.empty()) return std::nullopt;
  if (cage_)
    return level_creases_.distance(cage_->limit().crease_edges, cage_->limit_surface().positions, 1,
                                   &curves_.features.curves);
  return crease_distance(curves_.features.curves, mesh_.positions, layout_->segments, 1);
}

/// Makes the present mesh exact, measures it and keeps it if it is the best. Returns false if the fit must end.
bool RegionFit::judge(AutomaticFitTrial trial) {
  if (options_.makes_cage && !cage_) {  // the fit ended before it came to that
    begin_cage();
    ++trial.level;
  }
  make_exact(trial.relaxed_at.has_value());
  const QualityReport quality = measure_quality(mesh_);
  trial.through_planes = template_.through_planes;
  trial.wrong_sheets = template_.wrong_sheets;
  trial.mean_percent = trial.max_percent = 0;  // the trial may have those of another state
  const auto count = [&](const SurfaceDistance& distance) {
    trial.mean_percent = std::max(trial.mean_percent, 100 * distance.mean());
    trial.max_percent = std::max(trial.max_percent, 100 * distance.max());
  };
  count(target_.distance(refined_triangles(boundary_surface(mesh_, MeshTopology(mesh_)))));
  count(target_.interface_distance(mesh_));
  if (cage_) count(target_.distance(cage_->limit_surface()));
  trial.volume_percent = volume_percent();
  trial.self_intersections = runner_.intersecting_pairs(sheet_triangles(mesh_, MeshTopology(mesh_)), result_.report);
  const bool going = trial.self_intersections.has_value();
  keep_if_best(std::move(trial), quality, distance_of_curves(),
               layout_ ? layout_->routing.unfollowed : std::vector<UnfollowedCurve>{});
  return going;
}

/// Makes the present mesh a pillowed template of at most so many cells, if there is one; returns false if there is none
/// at all.
bool RegionFit::make_pillowed(std::size_t most) {
  double asked = kAskedShare * static_cast<double>(most);
  for (int round = 1;; ++round) {
    const std::optional<VolumeMesh> grid = make_grid(static_cast<std::size_t>(asked));
    if (!grid) return false;
    mesh_ = pillow_regions(*grid, pillow_choice(*grid));
    begin_mesh();
    const std::size_t got = mesh_.num_cells();
    if (got <= most || round == kGridTries || template_.cells_asked > static_cast<std::size_t>(asked) + 1) return true;
    asked *= kRetryShare * static_cast<double>(most) / static_cast<double>(got);
  }
}

/// Fits a pillowed grid that is refined once, unless the regions need too many cells for that. If a cage is made, it is
/// refined as often as asked for.
bool RegionFit::run_smooth(std::size_t cells) {
  // Share of the cells asked for: a pillowed grid of more would have too many once it is refined.
  constexpr double kMostExcess = 1.4;
  int levels = options_.makes_cage ? options_.levels : 1;
  const std::size_t coarse = cells_before(cells, levels);
  if (!make_pillowed(coarse)) return !no_template_.empty();
  if (options_.makes_cage) return fit_and_refine(levels);
  if (static_cast<double>(mesh_.num_cells()) > kMostExcess * static_cast<double>(coarse)) {
    levels = 0;
    if (mesh_.num_cells() < cells / 2 && !make_pillowed(cells)) return !no_template_.empty();
  }
  return fit_and_refine(levels);
}

/// Fits a pillowed grid that is not refined, so that the cells of the template itself are small.
bool RegionFit::run_unrefined(std::size_t cells) {
  layout_.reset();
  no_template_.clear();
  return make_pillowed(cells) ? fit_and_refine(0) : !no_template_.empty();
}

/// Fits a grid whose sheets are routed and padded. If a cage is made, that is the padded grid.
bool RegionFit::run_curves(std::size_t cells) {
  double asked = kAskedShare * static_cast<double>(cells);
  for (int round = 1;; ++round) {
    const std::optional<VolumeMesh> grid = make_grid(static_cast<std::size_t>(asked));
    if (!grid) return !no_template_.empty();
    mesh_ = *grid;
    begin_mesh();
    layout_.reset();
    cage_.reset();
    if (!is_exact(*grid) && !fit_level(0, smooth_quality_schedule(), ", smooth", kSmoothPortion)) {
      if (result_.trials.empty()) judge({.template_cells = grid->num_cells()});
      return false;
    }
    RoutingOptions routing;
    routing.cancelled = [this] { return runner_.is_to_end(); };
    layout_ = sheet_layout(*grid, mesh_.positions, unit_, curves_, routing, pillow_choice(*grid));
    mesh_ = layout_->tagged_mesh;
    if (mesh_.num_cells() > cells && options_.cells && round < kGridTries) {
      asked *= kRetryShare * static_cast<double>(cells) / static_cast<double>(mesh_.num_cells());
      continue;
    }
    AutomaticFitTrial trial{.template_cells = grid->num_cells(), .pads = layout_->pads.value_or(0)};
    if (options_.makes_cage &&
        !fit_level(0, coarse_quality_schedule(options_.quality, options_.tuning.quality), ", edges", kCoarsePortion)) {
      if (result_.trials.empty()) judge(std::move(trial));
      return false;
    }
    return fit_edges(std::move(trial), 1) && relax_last_trial();
  }
}

/// Returns false if the fit must end. InputError: there is no template, and there was none before.
bool RegionFit::run_count(std::size_t cells) {
  layout_.reset();
  cage_.reset();
  no_template_.clear();
  return follows_edges_ ? run_curves(cells) : run_smooth(cells);
}

void RegionFit::conclude() {
  FitReport& report = result_.report;
  const AutomaticFitTrial& chosen = best();
  report.explanation = formatted(
      "%zu regions, least scaled Jacobian %.3f, mean distance %.4g %%, largest %.4g %%, "
      "volumes within %.3g %%",
      original_.regions.size(), chosen.least_scaled_jacobian, chosen.mean_percent, chosen.max_percent,
      chosen.volume_percent);
  if (chosen.max_percent > options_.max_tolerance_percent || chosen.mean_percent > options_.mean_tolerance_percent ||
      chosen.volume_percent > kAutomaticVolumePercent || chosen.least_share < 1)
    report.warnings.push_back(formatted("not as good as aimed at (quality %.2f, distances %.3g and %.3g %%, volumes "
                                        "%.3g %%): ",
                                        options_.quality, options_.mean_tolerance_percent,
                                        options_.max_tolerance_percent, kAutomaticVolumePercent) +
                              report.explanation);
  if (chosen.wrong_sheets > 0)
    report.warnings.push_back(
        formatted("%zu interfaces or parts of the boundary have another topology than in the "
                  "target; more --cells may mend that",
                  chosen.wrong_sheets));
  warn_of_missed_edges(result_.missed_edges, chosen.curves, "curves", report);
  mark_if_far_off(result_, options_, "curves");
}

AutomaticFitResult RegionFit::run() {
  find_curves();
  if (options_.keeps_groups && !group_borders(original_.mesh, original_.mesh).empty())
    result_.report.warnings.push_back(
        "borders between groups of faces are not followed, because the target has several regions");
  result_.topology = solid_boundary(outer_surface(original_)).topology;
  std::vector<std::size_t> counts(kAutomaticCells.begin(), kAutomaticCells.end());
  if (options_.makes_cage) counts.push_back(kMostAutomaticCells);  // instead of meshes that are not refined
  if (follows_edges_) counts.assign(kAutomaticEdgeCells.begin(), kAutomaticEdgeCells.end());
  if (options_.cells)
    counts = {options_.makes_cage && follows_edges_ ? cells_before(*options_.cells, 1) : *options_.cells};
  if (options_.makes_cage && !follows_edges_) drop_equal_templates(options_.levels, counts);
  std::vector<AutomaticAttempt> attempts;
  const int levels = options_.makes_cage && follows_edges_ ? 1 : 0;  // from these counts to those of the mesh
  for (const std::size_t count : counts) attempts.push_back({AutomaticAttempt::Kind::smooth, count, levels});
  bool going = true;
  for (std::size_t i = 0; i < counts.size() && going && !is_good(); ++i) {
    begin_attempt(
        expected_portion(std::span(attempts).subspan(i), result_.trials.empty() ? nullptr : &best(), options_));
    going = run_count(counts[i]);
  }
  if (going && !is_good() && !follows_edges_ && !options_.cells && !options_.makes_cage) {
    begin_attempt();
    going = run_unrefined(counts.back());
  }
  if (result_.trials.empty() && !no_template_.empty()) throw InputError(no_template_);
  if (going) going = polish();
  if (going) conclude();
  if (result_.mesh.num_cells() > 0) add_interface_groups(result_.mesh);
  if (result_.cage.num_cells() > 0) add_interface_groups(result_.cage);
  return finish(going, "curves");
}

}  // namespace

AutomaticFitResult fit_regions(const RegionSurface& target, const AutomaticFitOptions& options) {
  return RegionFit(target, options).run();
}

}  // namespace subvol
