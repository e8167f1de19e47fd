// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/shell/shell.h"

#include "subvol/base/error.h"
#include "subvol/fit/energies/closest_point_energy.h"
#include "subvol/fit/energies/volume_energy.h"
#include "subvol/fit/mending/surface_faults.h"
#include "subvol/fit/mending/visible_normals.h"
#include "subvol/fit/solver/free_nodes.h"
#include "subvol/fit/solver/newton.h"
#include "subvol/fit/target/normalization.h"
#include "subvol/shell/thickness.h"
#include "subvol/surface/boundary.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <optional>

namespace subvol {

using namespace internal;
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kMostShellSolves = 12;  // strands that fail in all of them end at 0.02 of their thickness

void check_options(const PolygonMesh& surface, const ShellOptions& options) {
  const auto positive = [](double x) { return x > 0 && std::isfinite(x); };
  if (options.layers < 1) throw InputError("shell: layers must be at least 1, got " + std::to_string(options.layers));
  if (!positive(options.growth)) throw InputError("shell: growth must be positive");
  if (options.control.max_iterations < 0 || !(options.control.time_limit_seconds >= 0))
    throw InputError("shell: limits of a solve must not be negative");
  if (options.vertex_thickness.empty()) {
    if (!positive(options.thickness)) throw InputError("shell: thickness must be positive");
    return;
  }
  if (options.vertex_thickness.size() != surface.positions.size())
    throw InputError("shell: expected one thickness per vertex (" + std::to_string(surface.positions.size()) +
                     "), got " + std::to_string(options.vertex_thickness.size()));
  for (std::size_t v = 0; v < options.vertex_thickness.size(); ++v)
    if (!positive(options.vertex_thickness[v]))
      throw InputError("shell: the thickness at vertex " + std::to_string(v) + " must be positive");
}

Normalization normalization_of(const PolygonMesh& surface) {
  Eigen::AlignedBox3d box;
  for (const Vec3& p : surface.positions) box.extend(p);
  const double diagonal = box.diagonal().norm();
  if (!(diagonal > 0) || !std::isfinite(diagonal)) throw InputError("shell: the surface has no finite extent");
  return {box.center(), diagonal};
}

/// Makes one shell from its surface, in normalized coordinates.
class ShellMaker {
 public:
  ShellMaker(const PolygonMesh& surface, const ShellOptions& options)
      : given_(surface),
        options_(options),
        normalization_(normalization_of(surface)),
        layers_(normalized_layers(surface)),
        cells_(stack_cells(layers_)),
        check_(layers_, cells_, CheckedSheets::outer, options.free_surface) {}

  ShellResult run(const PolygonMesh& surface);

 private:
  void require_no_faults() const;
  void find_planes();
  void find_directions();
  void find_thickness();
  void require_visible_thickness() const;
  void start();
  void optimize();
  std::vector<std::uint8_t> fixed_vertices() const;
  std::vector<Mat3> projectors(std::span<const std::uint8_t> is_fixed) const;
  void return_to_planes();
  FitProblem make_problem(std::vector<Vec3>& unknowns) const;
  MinimizerStop solve(int round);
  void finish(const PolygonMesh& surface, ShellResult& result);
  /// Reports progress; returns false if the run must stop.
  bool tell(const char* stage, int iteration, double energy, double fraction);
  /// Checks only for cancellation and the time limit; `wanted` is the callback's last answer.
  bool goes_on(bool wanted);
  /// Returns true if the caller or the time limit wants the run to end.
  bool is_to_end() const {
    return ended_ || (options_.control.cancelled && options_.control.cancelled()) ||
           (options_.control.time_limit_seconds > 0 && seconds() > options_.control.time_limit_seconds);
  }
  /// Does a part of the work before there is a shell; not if the caller's `cancelled` ends the run.
  void begin_with(const char* part, double fraction, void (ShellMaker::*work)());
  double seconds() const { return std::chrono::duration<double>(Clock::now() - begin_).count(); }
  void timed(const char* part, void (ShellMaker::*work)());
  /// Names vertices of the surface with their given coordinates.
  std::string text_of(std::span<const Index> vertices) const {
    return text_of_vertices(vertices, given_.positions, options_.vertex_numbers);
  }

  /// Messages of `make_layers` name the given coordinates.
  ShellLayers normalized_layers(const PolygonMesh& surface) const {
    ShellLayers layers = make_layers(surface, options_.side == ShellSide::outward ? 0 : options_.layers,
                                     options_.side == ShellSide::inward ? 0 : options_.layers, options_.growth,
                                     {options_.vertex_numbers, options_.face_numbers});
    layers.surface.positions = normalization_.to_unit(std::move(layers.surface.positions));
    return layers;
  }

  const PolygonMesh& given_;
  const ShellOptions& options_;
  Normalization normalization_;
  ShellLayers layers_;
  VolumeMesh cells_;
  ShellCheck check_;
  Clock::time_point begin_ = Clock::now();
  std::vector<Vec3> directions_;
  std::vector<double> asked_, thickness_;
  std::vector<Vec3> start_, positions_;
  std::optional<TargetSurface> target_;  ///< the original surface, if its vertices are free
  FitReport report_;
  bool ended_ = false;  ///< true if the caller or the time limit ended the run
};

bool ShellMaker::tell(const char* stage, int iteration, double energy, double fraction) {
  if (ended_) return false;
  return goes_on(!options_.control.progress || options_.control.progress({stage, 0, iteration, energy, fraction}));
}

bool ShellMaker::goes_on(bool wanted) {
  if (ended_) return false;
  if (!wanted || (options_.control.cancelled && options_.control.cancelled())) {
    ended_ = true;
    report_.stop_reason = StopReason::cancelled;
    report_.explanation = "stopped by the caller";
  } else if (options_.control.time_limit_seconds > 0 && seconds() > options_.control.time_limit_seconds) {
    ended_ = true;
    report_.stop_reason = StopReason::time_limit;
    report_.explanation = "the time limit is reached";
  }
  return !ended_;
}

void ShellMaker::timed(const char* part, void (ShellMaker::*work)()) {
  const double before = seconds();
  (this->*work)();
  report_.seconds.emplace_back(part, seconds() - before);
}

void ShellMaker::begin_with(const char* part, double fraction, void (ShellMaker::*work)()) {
  tell(part, 0, 0, fraction);
  if (!options_.control.cancelled || !options_.control.cancelled()) timed(part, work);
}

void ShellMaker::require_no_faults() const {
  const SurfaceFaults faults = find_faults(given_, MendingGoal::layers, options_.control.cancelled);
  const std::string text = to_text(faults, given_, {options_.vertex_numbers, options_.face_numbers});
  if (!text.empty()) throw InputError(text);
}

/// Finds the planes of flat borders. Vertices for which the caller has given planes have no others.
void ShellMaker::find_planes() {
  std::vector<BorderPlane> planes = options_.border_planes;
  std::vector<char> is_given(layers_.num_columns(), 0);
  for (const BorderPlane& plane : planes)
    for (const Index v : plane.vertices) is_given[v] = 1;
  for (BorderPlane& plane : flat_border_planes(layers_.surface, layers_.topology)) {
    std::erase_if(plane.vertices, [&](Index v) { return is_given[v]; });
    if (!plane.vertices.empty()) planes.push_back(std::move(plane));
  }
  layers_.planes = ColumnPlanes(std::move(planes), layers_.num_columns());
}

void ShellMaker::find_directions() {
  require_no_faults();
  directions_ = visible_normals(layers_.surface).directions;
  find_planes();
  if (!layers_.planes.empty()) turn_into_planes(layers_, directions_);
}

void ShellMaker::find_thickness() {
  const std::size_t n = layers_.num_columns();
  asked_.assign(layers_.num_strands(), 0);
  for (std::size_t v = 0; v < n; ++v) {
    const double t = options_.vertex_thickness.empty() ? options_.thickness : options_.vertex_thickness[v];
    if (layers_.inside > 0) asked_[v] = t / normalization_.diagonal;
    if (layers_.outside > 0) asked_[n + v] = t / normalization_.diagonal;
  }
  thickness_ = limited_thickness(layers_, directions_, asked_);
}

void ShellMaker::start() {
  const std::vector<Vec3> thin = thinnest_shell(layers_, check_, directions_, thickness_, options_.control.cancelled,
                                                [this](std::span<const Index> v) { return text_of(v); });
  if (thin.empty()) {
    goes_on(true);
    return;
  }
  start_ = advance(layers_, check_, thin, straight_columns(layers_, directions_, thickness_),
                   [this] { return is_to_end(); });
  positions_ = start_;
  goes_on(true);
}

/// Returns for each vertex 1 if it is fixed, else 0.
std::vector<std::uint8_t> ShellMaker::fixed_vertices() const {
  std::vector<std::uint8_t> fixed(positions_.size(), 0);
  const SurfaceTopology& topology = layers_.topology;
  const auto fix = [&](Index v) { fixed[layers_.vertex(layers_.inside, v)] = 1; };
  if (!options_.free_surface)
    for (std::size_t v = 0; v < layers_.num_columns(); ++v) fix(static_cast<Index>(v));
  for (std::size_t h = 0; h < topology.twins.size(); ++h)
    if (topology.twins[h] == kNoIndex)
      fix(topology.corner_vertices[h]), fix(topology.corner_vertices[topology.next(static_cast<Index>(h))]);
  for (const CreaseEdge& crease : options_.tags.creases) fix(crease.v0), fix(crease.v1);
  for (const CornerVertex& corner : options_.tags.corners) fix(corner.vertex);
  return fixed;
}

/// Returns the projectors of the free vertices; none if no column stays in a plane.
std::vector<Mat3> ShellMaker::projectors(std::span<const std::uint8_t> is_fixed) const {
  std::vector<Mat3> result;
  if (layers_.planes.empty()) return result;
  for (std::size_t i = 0; i < is_fixed.size(); ++i) {
    const auto column = static_cast<Index>(i % layers_.num_columns());
    if (!is_fixed[i]) result.push_back(layers_.planes.projector({&column, 1}));
  }
  return result;
}

/// Moves the ends of columns exactly into their planes, from which rounding may have taken them.
void ShellMaker::return_to_planes() {
  if (layers_.planes.empty()) return;
  for (std::size_t i = 0; i < positions_.size(); ++i) {
    const auto column = static_cast<Index>(i % layers_.num_columns());
    const Mat3 projector = layers_.planes.projector({&column, 1});
    const Vec3& foot = layers_.surface.positions[column];
    if (projector != Mat3::Identity()) positions_[i] = foot + projector * (positions_[i] - foot);
  }
}

/// Makes the problem with the surface's vertices fixed, or drawn to the original surface.
FitProblem ShellMaker::make_problem(std::vector<Vec3>& unknowns) const {
  const std::vector<std::uint8_t> is_fixed = fixed_vertices();
  FreeNodes free = free_nodes(is_fixed, positions_);
  unknowns = std::move(free.unknowns);
  SparseMap nodes = std::move(free.map);
  std::vector<Vec3> fixed = std::move(free.fixed);
  std::vector<Index> sampled;
  std::vector<Vec3> fixed_samples;
  std::unique_ptr<SurfaceTerm> surface;
  double lambda = 1;
  if (options_.free_surface) {
    constexpr double kTangentialWeight = 1e-3, kFreeSurfaceLambda = 0.01;  // relative to 1 along the normal
    for (std::size_t v = 0; v < layers_.num_columns(); ++v) {
      sampled.push_back(layers_.vertex(layers_.inside, static_cast<Index>(v)));
      fixed_samples.push_back(fixed[sampled.back()]);
    }
    surface = std::make_unique<ClosestPointEnergy>(*target_, triangulate(layers_.surface).triangles, sampled.size(),
                                                   kTangentialWeight, 3);
    const double share = *std::max_element(thickness_.begin(), thickness_.end()) / target_->length();
    lambda = kFreeSurfaceLambda * share * share;
  }
  SparseMap samples = select_rows(nodes, sampled);
  FitProblem problem(std::move(nodes), std::move(samples),
                     std::make_unique<VolumeEnergy>(cells_, shell_reference(layers_, thickness_), 2),
                     std::move(surface), lambda);
  problem.fixed_nodes = std::move(fixed);
  problem.fixed_samples = std::move(fixed_samples);
  problem.projectors = projectors(is_fixed);
  return problem;
}

MinimizerStop ShellMaker::solve(int round) {
  std::vector<Vec3> unknowns;
  FitProblem problem = make_problem(unknowns);
  StageRecord& stage = report_.stages.emplace_back();
  stage.name = "solve " + std::to_string(round + 1);
  stage.lambda = problem.lambda;
  stage.unknowns = unknowns.size();
  stage.cells = cells_.num_cells();
  const double before = seconds();
  int iteration = 0;
  MinimizerOptions minimizer;
  minimizer.max_iterations =
      options_.control.max_iterations > 0 ? options_.control.max_iterations : kDefaultShellIterations;
  minimizer.ended = [this] { return is_to_end(); };
  minimizer.progress = [&](const IterationRecord& record) {
    ++iteration;
    const double in_round = static_cast<double>(iteration) / minimizer.max_iterations;
    return tell(stage.name.c_str(), iteration, record.surface_energy + problem.lambda * record.volume_energy,
                0.95 - 0.85 * std::pow(0.5, round) * (1 - 0.5 * in_round));
  };
  MinimizerResult found = minimize_newton(problem, unknowns, minimizer);
  // Ended within a step, without a call of the callback: sets the stop reason.
  if (found.stop == MinimizerStop::cancelled) goes_on(true);
  stage.ended = found.stop;
  stage.iterations = std::move(found.iterations);
  stage.stop = std::move(found.explanation);
  stage.seconds = seconds() - before;
  problem.apply_nodes(unknowns, positions_);
  return_to_planes();
  return found.stop;
}

void ShellMaker::optimize() {
  constexpr double kThicknessShrinkFactor = 0.7;  // of the thickness of strands that still meet another sheet
  bool apart = false;
  for (int round = 0; round < kMostShellSolves && !apart && !ended_; ++round) {
    const MinimizerStop stop = solve(round);
    if (stop == MinimizerStop::cancelled) break;
    const ShellFailures failures = check_.failures(positions_, [this] { return is_to_end(); });
    apart = failures.none();
    if (apart && report_.explanation.empty()) {
      report_.explanation = report_.stages.back().stop;
      report_.stop_reason = stop_reason(stop);
    }
    if (apart || round + 1 == kMostShellSolves) break;  // no solve follows that would use a smaller thickness
    for (const Index strand : check_.strands(failures)) thickness_[strand] *= kThicknessShrinkFactor;
    limit_slope(layers_, thickness_);
  }
  if (apart) return;
  std::vector<double> shares;
  positions_ = advance(
      layers_, check_, start_, positions_, [this] { return is_to_end(); }, &shares);
  goes_on(true);
  const auto held = std::count_if(shares.begin(), shares.end(), [](double share) { return share < 1; });
  if (held > 0)
    report_.warnings.push_back(std::to_string(held) +
                               " columns were held back: there sheets still met after the last solve");
  if (ended_) return;
  report_.stop_reason = StopReason::iteration_limit;
  report_.explanation = "sheets still met after " + std::to_string(kMostShellSolves) + " solves and were parted";
}

void ShellMaker::require_visible_thickness() const {
  const std::vector<double>& thickness = options_.vertex_thickness;
  const auto thinnest = std::min_element(thickness.begin(), thickness.end());
  std::string owner = "shell";
  if (!thickness.empty()) owner += ": at " + text_of(std::array{static_cast<Index>(thinnest - thickness.begin())});
  require_visible_layers(owner.c_str(), given_, thickness.empty() ? options_.thickness : *thinnest, options_.layers,
                         options_.growth);
}

ShellResult ShellMaker::run(const PolygonMesh& surface) {
  require_visible_thickness();
  cells_.tags = shell_tags(layers_, options_.tags);
  begin_with("directions", 0, &ShellMaker::find_directions);
  begin_with("thickness", 0.02, &ShellMaker::find_thickness);
  begin_with("start", 0.04, &ShellMaker::start);
  ShellResult result;
  if (positions_.empty()) {
    result.report = std::move(report_);
    return result;
  }
  if (options_.free_surface) target_.emplace(triangulate(layers_.surface));
  if (options_.optimize && !ended_) timed("solve", &ShellMaker::optimize);
  if (!options_.optimize && !ended_) report_.explanation = "straight columns, no solve";
  finish(surface, result);
  return result;
}

void ShellMaker::finish(const PolygonMesh& surface, ShellResult& result) {
  const double before = seconds();
  const double scale = normalization_.diagonal;
  result.layers = std::move(layers_);
  result.layers.surface = surface;
  result.mesh = std::move(cells_);
  const ShellLayers& layers = result.layers;
  for (std::size_t i = 0; i < positions_.size(); ++i)
    result.mesh.positions[i] = !options_.free_surface && layers.strand(static_cast<Index>(i)) == kNoIndex
                                   ? surface.positions[i % layers.num_columns()]
                                   : Vec3(normalization_.center + scale * positions_[i]);
  result.asked = std::move(asked_);
  result.limited = std::move(thickness_);
  for (double& t : result.asked) t *= scale;
  for (double& t : result.limited) t *= scale;
  MeasuredThickness measured = measure_thickness(layers, result.mesh.positions);
  result.achieved = std::move(measured.achieved);
  result.clearance = std::move(measured.clearance);
  result.surface_distance_max = measured.surface_distance_max;
  result.quality = measure_quality(result.mesh, 5, shell_reference(layers, result.limited));
  result.growth = options_.growth;
  result.corner_quality = measure_corner_quality(result.mesh);
  result.border_distance_max = distance_from_planes(layers, result.mesh.positions);
  result.mesh.face_groups = shell_groups(layers);
  result.failures = ShellCheck(layers, result.mesh, CheckedSheets::all).failures(result.mesh.positions);
  report_.seconds.emplace_back("check", seconds() - before);
  result.report = std::move(report_);
}

}  // namespace

ShellResult make_shell(const PolygonMesh& surface, const ShellOptions& options) {
  check_options(surface, options);
  return ShellMaker(surface, options).run(surface);
}

}  // namespace subvol
