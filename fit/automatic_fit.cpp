// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/automatic_fit.h"

#include "subvol/base/error.h"
#include "subvol/fit/automatic_attempts.h"
#include "subvol/fit/automatic_groups.h"
#include "subvol/fit/automatic_solid_driver.h"
#include "subvol/fit/automatic_trials.h"
#include "subvol/fit/features/crisp_edges.h"
#include "subvol/fit/features/curve_choice.h"
#include "subvol/fit/features/feature_routing.h"
#include "subvol/fit/fits/graded_template.h"
#include "subvol/fit/fits/local_cells.h"
#include "subvol/fit/geometry/boundary_triangles.h"
#include "subvol/fit/geometry/closest_point.h"
#include "subvol/fit/mending/surface_repair.h"
#include "subvol/fit/stages/quality_stages.h"
#include "subvol/mesh/mesh_topology.h"
#include "subvol/surface/boundary.h"
#include "subvol/surface/welded_surface.h"
#include "subvol/templates/auto_template.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace subvol {

using namespace internal;

namespace {

/// Largest share of the cells allowed that a template may have if some of its cells are to be cut.
constexpr double kMostShareOfGrid = 0.75;
/// Largest number of rounds in which some cells are cut: cells of size 1 / 9 are the smallest.
constexpr int kMostRefinementRounds = 2;
/// Numbers of cells, as shares of that of the first grid, of other grids on which edges are laid out. Whether a long
/// edge finds a path depends on where the lines of the grid happen to lie: of twelve grids of about 15,000 cells, five
/// lost one of 48 % of the diagonal of KlickyProbe_v0_2, and seven did not. Grids that are not through planes come
/// last.
constexpr std::array kOtherGrids{0.93, 0.87, 0.8, 0.73};
constexpr std::array kOtherFreeGrids{1.0, 0.87};

/// An automatic fit of one solid: the search among templates.
class AutomaticFit : AutomaticSolidDriver {
 public:
  /// target: as for `AutomaticSolidDriver`.
  AutomaticFit(const TriangleMesh& target, EdgeChoice follows, const AutomaticFitOptions& options)
      : AutomaticSolidDriver(target, follows, options) {}
  AutomaticFitResult run();

 private:
  const AutomaticTuning& tuning() const { return options_.tuning.automatic; }
  bool run_attempt(const AutomaticAttempt& attempt);
  bool run_smooth(const AutomaticAttempt& attempt);
  bool run_edges(const AutomaticAttempt& attempt);
  std::optional<AutoTemplate> make_grid(AutomaticAttempt::Kind kind, double cells);
  std::optional<AutomaticFitTrial> lay_out_on(AutoTemplate grid, AutomaticAttempt::Kind kind);
  /// Returns the number of edges above `kLongEdgePercent` that the present layout does not follow.
  std::size_t num_long_lost() const;
  bool try_other_grids(const AutomaticAttempt& attempt, double cells, const AutomaticFitTrial& first);
  bool run_graded();
  bool run_refined();
  bool fit_future_cage(RoutingOptions& routing);
  bool route_and_fit(const AutomaticFitTrial& described);
  bool is_worth_trying(const AutomaticAttempt& attempt) const {
    // A grid without planes is the grid of the attempt before.
    return attempt.kind != AutomaticAttempt::Kind::edges ||
           (aligned_share_ > 0 && aligned_share_ < tuning().most_aligned_share);
  }
  /// Number of cells up to which a fit is refined, if the number is free.
  double most_refined_cells() const {
    return tuning().most_refinement_growth * static_cast<double>(kAutomaticCells.back());
  }
  /// More cells are tried on a surface without edges as long as an aim is missed at all: they cost little there.
  bool is_strict() const { return !follows_.any() && !options_.makes_cage; }
  bool ends_search() const {
    constexpr double kEnoughQualityShare = 0.95;  // of the quality; what is missing is worth no more cells
    return is_good() &&
           (!is_strict() || (meets_distances(best(), options_) && best().least_share >= kEnoughQualityShare));
  }
  void take_best();
  /// Cages are not refined: cells that are cut have irregular edges, whose subdivision surfaces are poor.
  /// Nor are larger meshes, if the number of cells is free: it takes minutes and gains little.
  /// Nor are meshes that follow edges: with a free number of cells, the fits of 25 parts and models took up to twice as
  /// long with a refinement. It brought the best trial of four, whose merit was a little lower, and none became good by
  /// it. Cells between small and large ones are too poor.
  bool is_worth_refining() const {
    const bool has_room = options_.cells || static_cast<double>(best().cells) <= most_refined_cells();
    return !options_.makes_cage && !is_good() && has_room && best_start_.kind == AutomaticAttempt::Kind::smooth;
  }

  std::vector<AutomaticAttempt> skipped_;  ///< their grids were too coarse for many edges
  std::string refusal_;                    ///< why there was no template for the last attempt that had none
  std::optional<AutoTemplate> finest_;     ///< of the templates that were not refined, in the target's coordinates
  double aligned_share_ = 0;  ///< of the target's area on planes of the grid of the last attempt through planes
};

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
  begin_mesh();
  sizes_.clear();
  start_ = {};
  if (levels == 0) finest_ = std::move(made);
  return fit_and_refine(levels);
}

/// Brings the present layout near the target, to be a cage, then others while edges have to be given up. The mesh that
/// the cage is subdivided to would tell the same, but has eight times as many cells. Returns false if the fit must end.
bool AutomaticFit::fit_future_cage(RoutingOptions& routing) {
  double least_faults = std::numeric_limits<double>::infinity();
  for (int round = 0; round < tuning().most_routings; ++round) {
    if (round > 0) lay_out(routing);
    if (!fit_level(0, coarse_quality_schedule(options_.quality, options_.tuning.quality), ", edges", kCoarsePortion))
      return false;
    const std::vector<double> faults = faults_of_cells(true);
    const double sum = std::accumulate(faults.begin(), faults.end(), 0.0);
    if (sum >= least_faults) break;  // what was given up has not helped
    least_faults = sum;
    if (round + 1 == tuning().most_routings) break;  // the layout must be that of the routing's options
    if (!give_up_poor_curves(layout_->patched, edges_.features, layout_->routing, faults, routing)) break;
  }
  return true;
}

/// Fits the present layout, then others while edges have to be given up. Returns false if the fit must end.
bool AutomaticFit::route_and_fit(const AutomaticFitTrial& described) {
  RoutingOptions routing;
  routing.one_in = tuning().one_in;
  double least_merit = std::numeric_limits<double>::infinity();
  for (int round = 0; round < tuning().most_routings; ++round) {
    if (round > 0) lay_out(routing);
    AutomaticFitTrial trial = described;
    if (options_.makes_cage && !fit_future_cage(routing)) {
      if (result_.trials.empty()) judge(std::move(trial));
      return false;
    }
    trial.pads = layout_->pads.pads.size();
    if (!fit_edges(trial, kRoutingPortion)) return false;
    const double merit = result_.trials.back().merit;
    const std::vector<double> faults = faults_of_cells(meets_itself(result_.trials.back()));
    if (!relax_last_trial()) return false;
    if (merit >= least_merit) break;  // what was given up has not helped
    least_merit = merit;
    if (!give_up_poor_curves(layout_->patched, edges_.features, layout_->routing, faults, routing)) break;
  }
  return true;
}

/// Makes a grid of about so many cells. Returns nothing as `make_template`.
std::optional<AutoTemplate> AutomaticFit::make_grid(AutomaticAttempt::Kind kind, double cells) {
  const auto count = std::clamp(static_cast<std::size_t>(cells), kLeastTemplateCells, kMostTemplateCells);
  return make_template({.cells = count, .through_planes = kind == AutomaticAttempt::Kind::aligned});
}

/// Brings a grid near the target and lays out the edges on it. Returns nothing if the fit must end.
std::optional<AutomaticFitTrial> AutomaticFit::lay_out_on(AutoTemplate grid, AutomaticAttempt::Kind kind) {
  const AutomaticFitTrial described{.template_cells = grid.mesh.num_cells(),
                                    .through_planes = kind == AutomaticAttempt::Kind::aligned};
  if (fit_smoothly(std::move(grid.mesh), kind)) return described;
  if (result_.trials.empty()) judge(described);
  return std::nullopt;
}

std::size_t AutomaticFit::num_long_lost() const {
  return num_long_edges_lost(missed_edges(layout_->routing.unfollowed, target_.normalization));
}

/// Lays out the edges on other grids, and fits the first one that loses no long edge. Returns false if the fit must
/// end.
///
/// cells  that were asked for the first grid.
/// first  describes the trials of that grid.
bool AutomaticFit::try_other_grids(const AutomaticAttempt& attempt, double cells, const AutomaticFitTrial& first) {
  using Kind = AutomaticAttempt::Kind;
  std::vector<std::pair<Kind, double>> others;
  for (const double share : kOtherGrids) others.emplace_back(Kind::aligned, share);
  if (aligned_share_ >= tuning().most_aligned_share)  // else an attempt with such a grid follows
    for (const double share : kOtherFreeGrids) others.emplace_back(Kind::edges, share);
  std::set<std::pair<Kind, std::size_t>> seen{{Kind::aligned, first.template_cells}};
  std::size_t num_grids = 1;
  for (const auto& [kind, share] : others) {
    std::optional<AutoTemplate> grid = make_grid(kind, share * cells);
    if (!grid && no_template_.empty()) return false;
    no_template_.clear();
    if (!grid || !seen.emplace(kind, grid->mesh.num_cells()).second) continue;
    std::optional<AutomaticFitTrial> other = lay_out_on(*std::move(grid), kind);
    if (!other) return false;
    other->grids = ++num_grids;
    const bool has_room = !options_.cells || layout_->patched.mesh.num_cells() <= attempt.template_cells;
    if (has_room && num_long_lost() == 0) return route_and_fit(*other);
  }
  return true;
}

/// Fits a padded grid. Returns false if the fit must end.
bool AutomaticFit::run_edges(const AutomaticAttempt& attempt) {
  // After a grid that was too large, the next one is asked for this share of what would have fitted.
  constexpr double kRetryPaddedGridShare = 0.95;
  constexpr int kTries = 3;  // grids
  double asked = tuning().room_for_pads * static_cast<double>(attempt.template_cells);
  for (int trial = 1;; ++trial) {
    std::optional<AutoTemplate> grid = make_grid(attempt.kind, asked);
    if (!grid) return !no_template_.empty();
    if (attempt.kind == AutomaticAttempt::Kind::aligned) aligned_share_ = grid->aligned_share;
    std::optional<AutomaticFitTrial> described = lay_out_on(*std::move(grid), attempt.kind);
    if (!described) return false;
    const std::size_t padded = layout_->patched.mesh.num_cells();
    const bool is_least = asked <= static_cast<double>(kLeastTemplateCells);
    if (padded > attempt.template_cells && options_.cells && trial < kTries && !is_least) {
      asked *= kRetryPaddedGridShare * static_cast<double>(attempt.template_cells) / static_cast<double>(padded);
      continue;
    }
    const double routed = routed_share(layout_->routing, edges_.features.curves);
    if (!attempt.is_last_count && routed < tuning().least_routed_share) {
      skipped_.push_back(attempt);
      return true;
    }
    const std::size_t lost = num_long_lost();
    const auto most_lost = static_cast<std::size_t>(tuning().most_long_lost);
    if (!route_and_fit(*described)) return false;
    const bool may_gain = attempt.is_last_count && attempt.kind == AutomaticAttempt::Kind::aligned && lost > 0 &&
                          lost <= most_lost && best().long_edges_lost > 0;
    return !may_gain || try_other_grids(attempt, asked, *described);
  }
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
  target_.sample(0, static_cast<std::size_t>(options_.tuning.fitting.least_target_samples));
  const ClosestPoint fitted(refined_triangles(boundary_surface(result_.mesh, MeshTopology(result_.mesh))));
  std::vector<Vec3> places = missed_points(target_.surface, fitted, options_.max_tolerance_percent / 100);
  for (const Fault& fault : faults_of_best())
    for (const Index c : fault) places.push_back(cell_center(result_.mesh, result_.mesh.positions, c));
  SearchStop stop([this] { return !runner_.is_to_end(); });
  std::optional<SizedMesh> graded = graded_template(solid().surface, finest_->grid, finest_->kept,
                                                    target_.normalization.from_unit(std::move(places)), most, stop);
  if (stop.is_stopped()) {
    note_end_in("the grid with small cells");
    return false;
  }
  if (!graded) return true;
  target_.normalization.take_in(graded->mesh);
  layout_.reset();
  cage_.reset();
  mesh_ = std::move(graded->mesh);
  begin_mesh();
  sizes_ = graded->sizes;
  start_ = {.sizes = std::move(graded->sizes)};
  AutomaticFitTrial trial{.template_cells = finest_->mesh.num_cells(), .refined_cells = mesh_.num_cells()};
  return fit_level(0, aiming_at_distance(single_quality_schedule(options_.quality, options_.tuning.quality)),
                   ", graded") &&
         judge(trial) && relax_last_trial();
}

/// Cuts the cells at which the best trial, which follows no edges, is not as good as aimed at, and fits the result.
/// Returns false if the fit must end.
bool AutomaticFit::run_refined() {
  const AutomaticFitTrial before = best();
  const double most = options_.cells ? static_cast<double>(*options_.cells)
                                     : tuning().most_refinement_growth * static_cast<double>(before.cells);
  SearchStop stop([this] { return !runner_.is_to_end(); });
  std::optional<SizedMesh> refined =
      refined_at_faults(result_.mesh, best_start_.sizes, faults_of_best(), static_cast<std::size_t>(most), &stop);
  if (stop.is_stopped()) {
    note_end_in("the refinement of cells");
    return false;
  }
  if (!refined) return true;
  AutomaticFitTrial trial{
      .template_cells = before.template_cells, .refined_cells = refined->mesh.num_cells(), .level = before.level};
  layout_.reset();
  mesh_ = std::move(refined->mesh);
  begin_mesh(stages_of_best());
  sizes_ = refined->sizes;
  start_ = {.sizes = std::move(refined->sizes)};
  return fit_level(trial.level, aiming_at_distance(fine_quality_schedule(options_.quality, options_.tuning.quality)),
                   ", refined") &&
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
  sizes_ = best_start_.sizes;
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
      begin_attempt(attempts[i].portion.value_or(
          expected_portion(std::span(attempts).subspan(i), result_.trials.empty() ? nullptr : &best(), options_)));
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
  for (int round = 0; going && is_worth_refining() && round < kMostRefinementRounds; ++round) {
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
  return finish(going, "sharp edges");
}

}  // namespace

AutomaticFitResult fit_automatically(const TriangleMesh& given, const AutomaticFitOptions& options) {
  const TriangleMesh target = joined_at_open_edges(given);
  if (const std::optional<RegionSurface> regions = find_regions(target, options.regions))
    return fit_regions(*regions, options);
  const AutomaticFitOptions checked = checked_options(options);
  const EdgeDecision edges = decide_about_edges(target, checked.crease_angle_degrees, checked.follows_all_edges);
  const auto fit = [&](bool follows_borders, const AutomaticFitOptions& chosen) {
    const EdgeChoice follows{edges.follows, follows_borders};
    AutomaticFitResult result = follows.any() ? AutomaticFit(solid_boundary(target).surface, follows, chosen).run()
                                              : AutomaticFit(target, follows, chosen).run();
    if (!edges.warning.empty()) result.report.warnings.push_back(edges.warning);
    return result;
  };
  const bool may_follow_borders = checked.crease_angle_degrees && !options.keeps_groups && !options.makes_cage &&
                                  has_smooth_borders(target, *checked.crease_angle_degrees);
  if (may_follow_borders) return fit_for_groups(target, options, fit);
  return fit(options.keeps_groups && !group_borders(target, target).empty(), options);
}

}  // namespace subvol
