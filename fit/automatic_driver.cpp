// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/automatic_driver.h"

#include "subvol/base/format.h"
#include "subvol/base/sort_unique.h"
#include "subvol/fit/fits/smooth_refinement.h"
#include "subvol/fit/geometry/boundary_triangles.h"
#include "subvol/fit/geometry/self_intersection.h"
#include "subvol/fit/quality/quality.h"
#include "subvol/fit/target/surface_diagnosis.h"
#include "subvol/mesh/cell_topology.h"
#include "subvol/mesh/interfaces.h"
#include "subvol/mesh/mesh_topology.h"
#include "subvol/surface/boundary.h"
#include "subvol/templates/edge_levels.h"

#include <algorithm>
#include <functional>
#include <limits>
#include <utility>

namespace subvol::internal {

namespace {

/// A cell with a lower scaled Jacobian than this is hopeless where it is: the surface gives way to it.
double hopeless_quality(const AutomaticFitOptions& options) {
  return std::min(options.tuning.automatic.acceptable_quality, options.quality);
}

}  // namespace

double least_edge_share(const VolumeMesh& grid, std::span<const Vec3> lengths) {
  // The share for a grid of cubes. For a grid through planes, whose lines are at least kLeastLineGap apart, it is
  // smaller in proportion to the shortest edge.
  constexpr double kLeastCubeEdgeShare = 0.1;
  if (grid.num_cells() == 0) return 0;
  double shortest = kLeastLineGap;
  for (std::size_t c = 0; c < grid.num_cells(); ++c) {
    const CellTopology& cell = cell_topology(grid.kinds[c]);
    const auto vertices = grid.cell(c);
    for (int e = 0; e < cell.num_edges; ++e) {
      const Vec3 &a = grid.positions[vertices[cell.edges[e][0]]], &b = grid.positions[vertices[cell.edges[e][1]]];
      shortest = std::min(shortest, (b - a).norm() / lengths[c].maxCoeff());
    }
  }
  return kLeastCubeEdgeShare * shortest / kLeastLineGap;
}

TriangleMesh sheet_triangles(const VolumeMesh& mesh, const MeshTopology& topology,
                             std::vector<Index>* face_of_triangle) {
  std::vector<Index> faces(topology.boundary_faces().begin(), topology.boundary_faces().end());
  const std::vector<Index> inner = find_interfaces(mesh, topology).faces;
  faces.insert(faces.end(), inner.begin(), inner.end());
  PolygonMesh polygons{.positions = mesh.positions};
  for (const Index f : faces) {
    const auto corners = topology.face(f);
    polygons.face_vertices.insert(polygons.face_vertices.end(), corners.begin(), corners.end());
    polygons.face_offsets.push_back(polygons.face_vertices.size());
  }
  TriangleMesh triangles = refined_triangles(polygons, face_of_triangle);
  if (face_of_triangle)
    for (Index& polygon : *face_of_triangle) polygon = faces[polygon];
  return triangles;
}

std::function<bool(double)> AutomaticDriver::begin_template() {
  begin_part(kTemplatePortion, 1);
  return [this](double fraction) {
    runner_.work().set(fraction);
    return !runner_.is_to_end() && (!options_.control.progress ||
                                    options_.control.progress({"template", 0, 0, fraction, runner_.work().share()}));
  };
}

QualitySchedule AutomaticDriver::aiming_at(double max_percent, QualitySchedule schedule) const {
  // As in the merit of a trial, poor cells cost more than a place that is slightly too far. With the weights of other
  // lifts, y-belt-idler kept a scaled Jacobian of 0.28 rather than a largest distance of 0.58 % for 0.52.
  schedule.merit = {.excess = 1, .poor = 3};
  schedule.most_distance = options_.tuning.quality.max_margin * max_percent / 100;
  return schedule;
}

void AutomaticDriver::begin_cage() {
  cage_.emplace(std::move(mesh_), options_.tuning);
  mesh_ = cage_->mesh();
}

bool AutomaticDriver::fit_and_refine(int levels) {
  AutomaticFitTrial trial{.template_cells = mesh_.num_cells(), .level = levels};
  bool going = true;
  for (int level = 0; going && level < levels; ++level) {
    going = fit_level(level, coarse_quality_schedule(options_.quality, options_.tuning.quality), "", kCoarsePortion);
    if (!going)
      trial.level = level;
    else if (options_.makes_cage && level + 1 == levels)
      begin_cage();
    else
      mesh_ = smooth_refinement(mesh_);
  }
  if (going)
    going =
        fit_level(levels,
                  aiming_at_distance(levels == 0 ? single_quality_schedule(options_.quality, options_.tuning.quality)
                                                 : fine_quality_schedule(options_.quality, options_.tuning.quality)),
                  "");
  if (going || result_.trials.empty()) going = judge(trial) && going;
  return going && relax_last_trial();
}

bool AutomaticDriver::fit_edges(AutomaticFitTrial trial, double portion) {
  if (options_.makes_cage) {
    begin_cage();
    trial.level = 1;
  }
  const QualitySchedule schedule = cage_ ? fine_quality_schedule(options_.quality, options_.tuning.quality)
                                         : single_quality_schedule(options_.quality, options_.tuning.quality);
  const bool going = fit_level(trial.level, aiming_at_distance(schedule), ", edges", portion);
  return going || result_.trials.empty() ? judge(std::move(trial)) && going : going;
}

void AutomaticDriver::sample_target(std::size_t faces) {
  constexpr std::size_t kSamplesPerFace = 4, kMostSamplesPerFace = 8;  // of the target, for each boundary face
  target_.sample(kSamplesPerFace * faces, 1, kMostSamplesPerFace * faces);
}

bool AutomaticDriver::run_stages(const QualityBoundary& boundary, std::span<const Vec3> lengths,
                                 const std::function<CreaseEnergy(double)>& creases, int level,
                                 const QualitySchedule& schedule, const char* what,
                                 const std::function<void(QualityStages&)>& prepare) {
  QualityStages stages(mesh_, lengths, cage_ ? cage_->level().nodes : identity_map(mesh_.num_vertices()), {}, boundary,
                       target_.surface, creases, options_.tuning.quality);
  if (prepare) prepare(stages);
  if (!std::exchange(has_started_, true))
    result_.report.note_start(target_.compare_start(refined_triangles(boundary_surface(mesh_, MeshTopology(mesh_)))));
  if (options_.keep_states) {
    if (!schedule.stages.empty()) states_ = {{"start", unknowns()}};  // else the mesh was fitted before
    stages.after_stage = [this](const std::string& name, const std::vector<Vec3>& x) { states_.push_back({name, x}); };
  }
  StageRecord record;
  record.name = formatted("%zu cells, level %d%s", mesh_.num_cells(), level, what);
  record.level = level;
  record.cells = mesh_.num_cells();
  const std::size_t first = result_.report.stages.size();
  const bool going = (!is_relaxing_ || relax_hopeless_cells(stages, record)) &&
                     stages.run(schedule, runner_, record, unknowns(), result_.report);
  for (std::size_t i = first; i < result_.report.stages.size(); ++i) stages_.push_back(i);
  follow_cage();
  state_ = stages.state();
  return going;
}

std::vector<Index> AutomaticDriver::cells_that_meet(const VolumeMesh& mesh) const {
  const MeshTopology topology(mesh);
  std::vector<Index> face_of_triangle, cells;
  const TriangleMesh sheets = sheet_triangles(mesh, topology, &face_of_triangle);
  for (const auto& pair : self_intersections(sheets, [this] { return runner_.is_to_end(); }).pairs)
    for (const Index t : pair) cells.push_back(topology.face_cells(face_of_triangle[t])[0]);
  return cells;
}

/// Returns the cells at faces that meet and those below the hopeless quality, ascending.
/// may_meet: false if no faces are known to meet.
std::vector<Index> AutomaticDriver::hopeless_cells(bool may_meet) const {
  std::vector<Index> cells;
  if (may_meet) cells = cells_that_meet(mesh_);
  const std::vector<double> least = measure_quality(mesh_).cell_minima;
  for (std::size_t c = 0; c < least.size(); ++c)
    if (least[c] < hopeless_quality(options_)) cells.push_back(static_cast<Index>(c));
  sort_unique(cells);
  return cells;
}

/// Relaxes the mesh around hopeless cells, each time with less weight of the surface and, every other time, one ring of
/// cells farther out, until there are none: there the cells take the room that they want, as on the grid. Returns false
/// if the fit must end.
bool AutomaticDriver::relax_hopeless_cells(QualityStages& stages, const StageRecord& record) {
  constexpr int kRelaxationSteps = 6;           // of each round
  constexpr int kMostFruitlessRounds = 4;       // rounds without fewer hopeless cells: no success was seen after two
  constexpr double kSurfaceWeightFactor = 0.1;  // from one round to the next
  const QualityWeights weights{.hinge = 50, .threshold = 0.5};
  double surface = options_.tuning.automatic.first_surface_weight;
  std::size_t fewest = std::numeric_limits<std::size_t>::max();
  const int most_rounds = options_.tuning.automatic.most_relaxation_rounds;
  for (int round = 0, fruitless = 0; round < most_rounds; ++round, surface *= kSurfaceWeightFactor) {
    const std::vector<Index> cells = hopeless_cells(round > 0 || meets_itself(result_.trials.back()));
    if (runner_.is_to_end()) {
      note_end_in("the relaxation of hopeless cells");
      return false;
    }
    fruitless = cells.size() < fewest ? 0 : fruitless + 1;
    fewest = std::min(fewest, cells.size());
    if (cells.empty() || fruitless == kMostFruitlessRounds) break;
    if (!relaxed_at_) relaxed_at_ = target_.normalization.from_unit({mesh_.positions[mesh_.cell(cells[0])[0]]})[0];
    const int rings = 1 + round / 2;
    const std::vector<Vec3> before = unknowns();
    const bool going =
        stages.relax(cells, rings, {surface, weights, kRelaxationSteps}, runner_, record, unknowns(), result_.report);
    follow_cage();
    if (!going) return false;
    if (unknowns() == before) break;  // the patches would be most of the mesh
  }
  return true;
}

bool AutomaticDriver::relax_last_trial() {
  AutomaticFitTrial trial = result_.trials.back();
  const bool is_hopeless =
      trial.self_intersections.value_or(0) > 0 || trial.least_scaled_jacobian < hopeless_quality(options_);
  if (!is_hopeless || merit_if_relaxed(trial, options_) >= best().merit) return true;
  relaxed_at_.reset();
  is_relaxing_ = true;
  // Without stages and lift, the level is only judged by the quality and the distance aimed at.
  const bool going =
      fit_level(trial.level, aiming_at_distance({{}, {}, options_.quality}), ", relaxed", kRoutingPortion);
  is_relaxing_ = false;
  trial.relaxed_at = relaxed_at_;
  return judge(std::move(trial)) && going;
}

bool AutomaticDriver::polish() {
  constexpr double kPolishToleranceShare = 0.02;  // share of the tolerance that is always allowed
  const AutomaticTuning& tuning = options_.tuning.automatic;
  const double step = tuning.polish_quality_step;
  constexpr int kPointsPerDirection = 3;  // the corners and the points half-way between them
  if (!is_good() || !is_present_best() || last_polished_ == result_.chosen) return true;
  last_polished_ = result_.chosen;
  AutomaticFitTrial trial = best();
  trial.is_polished = true;
  const double tolerance = options_.max_tolerance_percent;
  const double most_percent =
      std::clamp(tuning.polish_distance_growth * trial.max_percent, kPolishToleranceShare * tolerance, tolerance);
  bool going = true, reached = true, is_lifted = false;
  for (int i = 1; going && reached && options_.quality + i * step < kMostQuality + step / 2; ++i) {
    const double goal = std::min(options_.quality + i * step, kMostQuality);
    const std::vector<double> least = measure_quality(mesh_, kPointsPerDirection).cell_minima;
    const auto poor = std::ranges::count_if(least, [goal](double quality) { return quality < goal; });
    const double most = (cage_ ? tuning.most_poor_of_cage : tuning.most_poor) * static_cast<double>(least.size());
    if (static_cast<double>(poor) > most) break;
    going = fit_level(trial.level, aiming_at(most_percent, late_quality_schedule(goal, options_.tuning.quality)),
                      ", polished");
    reached = state_.merit >= 1;
    is_lifted = true;
  }
  if (!is_lifted) return going;
  // The share of the quality that is reached is the one of the quality aimed at.
  going = going && fit_level(trial.level, {{}, {}, options_.quality}, ", polished");
  going = judge(std::move(trial)) && going;
  if (is_present_best()) last_polished_ = result_.chosen;
  return going;
}

bool AutomaticDriver::keep_if_best(AutomaticFitTrial trial, const QualityReport& quality,
                                   std::optional<CreaseDistance> edges, std::span<const UnfollowedCurve> unfollowed) {
  trial.least_share = state_.is_judged() ? state_.cells.least_share
                                         : std::clamp(quality.min_scaled_jacobian / options_.quality, 0.0, 1.0);
  if (edges) edges->farthest = target_.normalization.from_unit({edges->farthest})[0];
  std::vector<MissedEdge> missed = missed_edges(unfollowed, target_.normalization);
  trial.long_edges_lost = num_long_edges_lost(missed);
  if (!add_trial(std::move(trial), mesh_, quality, edges, options_, result_)) return false;
  result_.cage = cage_ ? cage_->cage : VolumeMesh();
  result_.states = states_;
  stages_of_best_ = stages_;
  result_.missed_edges = std::move(missed);
  return true;
}

AutomaticFitResult AutomaticDriver::finish(bool going, const char* edges) {
  if (!going && result_.report.explanation.empty()) note_end_in("the fit");
  if (!going && !result_.trials.empty())
    warn_of_missed_edges(result_.missed_edges, best().curves, edges, result_.report);
  if (options_.cells && result_.mesh.num_cells() > *options_.cells)
    result_.report.warnings.push_back(
        formatted("the result has %zu cells, more than the %zu allowed: no template with "
                  "fewer was found for the target",
                  result_.mesh.num_cells(), *options_.cells));
  if (!result_.trials.empty() && best().relaxed_at)
    result_.report.warnings.push_back(
        "details of the target are narrower than the mesh's cells: the mesh met itself or had poor cells there; it was "
        "relaxed and follows the target less closely, first at " +
        to_text(*best().relaxed_at) + "; more cells may hold the details");
  if (!result_.trials.empty()) {
    result_.report.undo_stages(0, result_.report.stages.size());
    for (const std::size_t i : stages_of_best_) result_.report.stages[i].kept = true;
  }
  const Normalization& normalization = target_.normalization;
  result_.mesh.positions = normalization.from_unit(std::move(result_.mesh.positions));
  result_.cage.positions = normalization.from_unit(std::move(result_.cage.positions));
  for (FitState& state : result_.states) state.positions = normalization.from_unit(std::move(state.positions));
  result_.report.seconds = {{"total", runner_.seconds()}};
  return std::move(result_);
}

}  // namespace subvol::internal
