// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/features/feature_curves.h"
#include "subvol/fit/features/not_followed.h"
#include "subvol/fit/stages/fit_options.h"
#include "subvol/fit/stages/fit_report.h"
#include "subvol/fit/stages/solve_control.h"
#include "subvol/fit/target/feature_size.h"
#include "subvol/fit/tuning/tuning.h"
#include "subvol/mesh/fit_state.h"
#include "subvol/mesh/volume_mesh.h"
#include "subvol/surface/region_surface.h"
#include "subvol/surface/solid_topology.h"
#include "subvol/surface/triangle_mesh.h"

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

namespace subvol {

/// Distances that an automatic fit aims at, in percent of the diagonal.
inline constexpr double kAutomaticMeanPercent = 0.02, kAutomaticMaxPercent = 0.5;
/// Largest distance from a small feature (`FeatureSizes`) that an automatic fit aims at, as a share of its radius.
inline constexpr double kAutomaticFeatureShare = 0.1;
/// Largest difference of a region's volume that an automatic fit aims at, in percent of that volume.
inline constexpr double kAutomaticVolumePercent = 0.1;
/// A result that is this many times farther from the target than the largest distance aimed at is far off, and its stop
/// reason says so.
inline constexpr double kFarOffFactor = 2;
/// So is one that does not follow a sharp edge longer than this, in percent of the diagonal, or that misses a feature
/// by more than its radius, if the radius is at least this, in percent of the diagonal: noise of a triangulation looks
/// like smaller ones.
inline constexpr double kLongEdgePercent = 10, kLostFeaturePercent = 0.2;
/// So is one of which a region's volume differs by this many times what is aimed at.
inline constexpr double kFarOffVolumeFactor = 10;
/// So is one of which the volume of the only solid differs by this much, in percent of it: a plate that is thinner than
/// the distances may come out several times as thick.
inline constexpr double kFarOffSolidVolumePercent = 5;
/// Numbers of cells that are tried if none is given, in this order until a fit is good: of surfaces without sharp
/// edges, and of parts with them.
inline constexpr std::array<std::size_t, 3> kAutomaticCells{5000, 15000, 40000};
inline constexpr std::array<std::size_t, 3> kAutomaticEdgeCells{3000, 10000, 30000};
/// Number that is tried at last on surfaces without sharp edges, if these were not enough for all aims: more cost more
/// than a minute.
inline constexpr std::size_t kMostAutomaticCells = 100000;

/// Options of `fit_automatically` and `fit_regions`.
struct AutomaticFitOptions {
  /// Number of cells that the result may have, at least kLeastTemplateCells; more only if no smaller template has the
  /// solid's topology. Empty: as few as make the fit good, of the counts above.
  std::optional<std::size_t> cells;
  double quality = kUsualQuality;  ///< least scaled Jacobian to aim at, in [0, 0.8]; below 0.1: 0.1
  /// Edges of the target sharper than this angle stay sharp. In [0, 180]; empty: none.
  std::optional<double> crease_angle_degrees = kUsualCreaseAngle;
  /// False: edges are followed only on surfaces of designed parts (`EdgeCrispness::is_designed`), not on scans.
  bool follows_all_edges = false;
  RegionRule regions = RegionRule::automatic;  ///< how targets with several regions are taken (`find_regions`)
  /// Borders between groups of the target's faces are followed like sharp edges, also where the surface is smooth. If
  /// not set, and edges are followed (`crease_angle_degrees`), this is tried if a result without it misses groups.
  bool keeps_groups = false;
  /// The result is a subdivision volume: a control mesh, the cage, whose vertices are the degrees of freedom, and the
  /// mesh that it is subdivided to once. `cells` are then those of that mesh.
  bool makes_cage = false;
  /// Number of times that the template of a cage is subdivided to the mesh, in [1, 6]; once if edges are followed.
  int levels = 1;
  double mean_tolerance_percent = kAutomaticMeanPercent, max_tolerance_percent = kAutomaticMaxPercent;  ///< > 0
  SolveControl control{};
  bool keep_states = false;  ///< fills AutomaticFitResult::states
  Tuning tuning{};           ///< for experiments
};

/// A sharp edge of the target that no edges of the mesh follow, or not all along.
struct MissedEdge {
  NotFollowed reason;
  Vec3 place;                 ///< a point that is not followed, in the target's coordinates
  double length_percent = 0;  ///< of all of it that is not followed, in percent of the diagonal
};

/// One template that was fitted, and what came out.
struct AutomaticFitTrial {
  std::size_t template_cells = 0, cells = 0;
  bool through_planes = false;  ///< the template's grid lines pass through planes of the target
  std::size_t grids = 1;  ///< grids on which the edges were laid out until one lost no long edges; this is the last
  std::size_t refined_cells = 0;                ///< of the grid or mesh after some of its cells were cut; 0: none was
  std::size_t pads = 0;                         ///< layers of cells under patches between sharp edges
  std::size_t curves = 0, followed_curves = 0;  ///< of the target's sharp edges
  double within_share = 1;                      ///< share of their length within `kSharpPercent` of edges of the mesh
  std::size_t long_edges_lost = 0;              ///< longer than `kLongEdgePercent`, but for those that are too acute
  int level = 0;                                ///< times the template was subdivided
  double mean_percent = 0, max_percent = 0;     ///< distance, percent of the target's diagonal
  std::optional<FeatureMiss> feature_miss;      ///< in the target's unit; empty: there are no small features
  /// The feature, of those with a radius of at least `kLostFeaturePercent`, that is missed by the largest share of its
  /// radius, if by more than all of it; empty: no such feature is lost.
  std::optional<FeatureMiss> lost_feature;
  double least_scaled_jacobian = 0, mean_scaled_jacobian = 0;
  double least_share = 0;  ///< least share of the quality that a cell reaches, less being asked at sharp edges
  std::size_t uncertified = 0;
  double volume_percent = 0;  ///< largest difference of a region's volume from the target's, if it has regions
  /// Difference of the solid's volume from the target's, if that has no regions and is closed.
  double solid_volume_percent = 0;
  std::optional<std::size_t> self_intersections;  ///< pairs of triangles; empty: the search was interrupted
  /// A place at which the boundary met itself or cells were poor, and the mesh was relaxed, in the target's
  /// coordinates; empty: there was none.
  std::optional<Vec3> relaxed_at;
  std::size_t wrong_sheets = 0;  ///< of a target with regions: those whose topology the template does not have
  bool is_polished = false;      ///< it is the trial before, lifted beyond the quality aimed at
  double merit = 0;              ///< 0: all aims are reached; lower is better
};

/// The best trial of an automatic fit, and what was tried.
struct AutomaticFitResult {
  VolumeMesh cage;  ///< with its tags; its limit surface is the fitted surface; empty unless asked for
  VolumeMesh mesh;  ///< hexes, with tags on the creases that follow edges of the target
  FitReport report;
  BettiNumbers topology;                 ///< of the solid
  std::vector<MissedEdge> missed_edges;  ///< the longest first
  std::vector<AutomaticFitTrial> trials;
  std::size_t chosen = 0;        ///< position in trials
  std::vector<FitState> states;  ///< of the chosen trial's last mesh, from its start; without the result
};

/// Fills the solid inside a surface with hexes that one can compute on: no template is given, and every vertex of the
/// result is free.
///
/// Without sharp edges: a pillowed template of about an eighth of the cells (`auto_templates`) is fitted by
/// `QualityStages`, refined once (`smooth_refinement`) and fitted again. If the result is too far from the target, too
/// poor or meets itself, larger templates are tried if the number of cells is free, and then one with as many cells as
/// allowed, or as are tried last, which is not refined.
///
/// With sharp edges: a grid, through the target's planes where it has any, is fitted smoothly, only to find out what
/// lies where. The edges are routed on it, and patches between them are padded (`edge_layout`). That mesh is fitted
/// from the grid's positions, with creases, each patch against its own regions of the target. Edges at which cells stay
/// poor are given up, and the rest is routed anew. A grid that is not through planes is tried, too, if less than 40 %
/// of the target's area lies on them. If the grid of the largest number of cells loses one or two edges longer than
/// `kLongEdgePercent`, the edges are laid out on up to six others, and the first one that loses no such edge is fitted
/// as well.
///
/// If no grid has the solid's topology, the next attempt has finer ones.
///
/// Faces on flat parts of such a target are made exactly flat (`flatten_faces`). A number of cells at which less than
/// 80 % of the edges' length finds a path is skipped if a larger one follows.
///
/// The best trial is kept; no other is made once the merit is below 0.15, not counting a share of the quality of 85 %
/// or more, or, if there are no edges to follow, once it meets the distances and 95 % of the quality:
///
///   merit = max(0, max distance / tolerance - 1) + max(0, mean distance / tolerance - 1)
///         + min(3, max(0, largest miss of a feature / 0.1 of its size - 1)) if the target has sharp edges
///         + min(3, max(0, difference of the volume / 5 % - 1))
///         + 5 (1 - least share of the quality that a cell reaches) + 5 max(0, 1 - least scaled Jacobian / 0.3)
///         + 3 (1 - share of the edges within 0.1 %)
///         + 1.5 if edges longer than 10 % are not followed, but for acute ones, if a feature is lost, or if the volume
///           differs by more than 5 %
///         + 10 unless the boundary is found not to meet itself + 10 if cells are uncertified
///
/// The weights, the 0.15, the 85 % and the 0.3 are defaults of `AutomaticTuning`. The 0.3 is the quality aimed at if
/// that is lower. Features whose radius is below the mean tolerance do not count.
///
/// A trial that would be the best one but for a boundary that meets itself or for cells below 0.3 is relaxed there and
/// judged again: the cells around are minimized with less and less weight of the surface, until they take the room that
/// they had on the grid.
///
/// If no trial is good and there are no edges to follow, a template is tried whose grid has smaller cells where the
/// best trial is too far from the target, meets itself or has poor cells (`fit/fits/graded_template.h`).
///
/// If no trial is good still, cells of the best one are cut in 27 where it meets itself, where it is too far from the
/// target, and where cells are poor (`fit/fits/local_cells.h`), and the result is fitted: up to twice, and to the
/// number of cells allowed, or half as many again if the number is free. Meshes that follow edges are not refined.
///
/// If no trial is valid, a pillowed template is fitted without edges: a valid mesh with round edges is worth more.
///
/// The good trial is polished: it is lifted by steps of 0.05 beyond the quality aimed at, up to 0.8, as long as they
/// are reached while the largest distance grows by a fifth at most. The result is another trial; if it is good, too,
/// the one with the higher least scaled Jacobian is kept, unless only the other one meets the distances.
///
/// With `makes_cage`, the mesh that comes before the last subdivision, or the padded mesh, is fitted by the schedule of
/// meshes that are refined. Then it is the cage (`FittedCage`): its vertices are the unknowns of all that follows, and
/// the mesh that it is subdivided to is lifted and judged; distances are the larger ones of its faces' and of the limit
/// surface's. No cells are cut.
///
/// The stop reason is `tolerance_missed` if the result is far off: by the constants above, which the explanation names.
///
/// A target with several regions (`find_regions`) is filled as `fit_regions` says.
///
/// InputError: options out of range, a surface that `auto_templates` refuses or whose topology no grid reproduces.
/// Same bits for any number of threads, except under a time limit.
AutomaticFitResult fit_automatically(const TriangleMesh& target, const AutomaticFitOptions& options = {});

/// Fills several regions with hexes whose interfaces conform: the references of cells are the regions' numbers, and
/// faces between regions are in groups (`add_interface_groups`).
///
/// The template is a grid labeled by region (`region_template`), with layers of cells on both sides of sheets: those
/// of designed parts end at sheets that need none (`pad_sheets`), others are closed (`pillow_regions`). Sheets of
/// regions (a, b) and the target's triangles between a and b correspond to each other and to nothing else. If the
/// target is a designed part, sharp edges and the curves where sheets meet are routed on the sheets (`sheet_layout`),
/// so that parts of sheets correspond to parts between curves, and faces on flat parts become exactly flat. Else the
/// template has about an eighth of the cells and is refined once, unless the regions need more; without `cells`, one of
/// 40,000 cells that is not refined is tried at last.
///
/// With `makes_cage`, a cage is made as by `fit_automatically`, and 100,000 cells are tried at last. Interfaces of the
/// cage are subdivision surfaces. The regions of the mesh have the volumes of the target's. Borders between groups are
/// not followed.
///
/// Larger templates are tried, and trials relaxed, as by `fit_automatically`; distances are the largest of the outer
/// surface's and of all interfaces', and the merit also counts
///
///   min(3, max(0, largest difference of a region's volume / 0.1 % - 1))
///
/// InputError: options out of range; a region whose boundary bounds no solid (`solid_boundary`); regions whose topology
/// no grid reproduces.
AutomaticFitResult fit_regions(const RegionSurface& target, const AutomaticFitOptions& options = {});

}  // namespace subvol
