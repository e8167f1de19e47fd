// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/automatic_fit.h"

#include "fit/certificate/certificate.h"
#include "fit/elements/boundary_samples.h"
#include "fit/fits/smooth_refinement.h"
#include "fit/geometry/boundary_triangles.h"
#include "fit/quality/quality.h"
#include "fit/target/fit_target.h"
#include "subvol/base/error.h"
#include "subvol/base/format.h"
#include "subvol/base/option_checks.h"
#include "subvol/mesh/features.h"
#include "subvol/mesh/mesh_topology.h"
#include "subvol/surface/boundary.h"
#include "subvol/templates/auto_template.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <utility>

namespace subvol {

namespace {

constexpr std::size_t kChildren = 8;         // hexes of a hex that is subdivided
constexpr double kRoomForTemplates = 0.85;   // share of the cells allowed that a template is asked for first
constexpr double kMostQuality = 0.8;
/// The lift aims at this share of the largest distance allowed: it measures at samples, which miss the farthest places.
constexpr double kMaxMargin = 0.8;

void check(const AutomaticFitOptions& options) {
  const auto in_range = [](const char* name, double value, double low, double high) {
    require_in_range("AutomaticFitOptions", name, value, low, high);
  };
  in_range("quality", options.quality, 1e-3, kMostQuality);
  if (options.crease_angle_degrees) in_range("crease_angle_degrees", *options.crease_angle_degrees, 0, 180);
  in_range("mean_tolerance_percent", options.mean_tolerance_percent, 1e-9, 100);
  in_range("max_tolerance_percent", options.max_tolerance_percent, 1e-9, 100);
  in_range("max_iterations", options.max_iterations, 0, 1e9);
  in_range("time_limit_seconds", options.time_limit_seconds, 0, 1e12);
  if (options.cells)
    in_range("cells", static_cast<double>(*options.cells), kChildren * kLeastTemplateCells, 1e9);
}

/// One attempt: a template of at most so many cells, and the number of times it is subdivided.
struct Attempt {
  std::size_t template_cells;
  int levels;
};

std::vector<Attempt> attempts_of(const AutomaticFitOptions& options) {
  if (options.cells) return {{*options.cells / kChildren, 1}, {*options.cells, 0}};
  std::vector<Attempt> attempts;
  for (const std::size_t cells : {kFirstAutomaticCells, kSecondAutomaticCells, kLastAutomaticCells})
    attempts.push_back({cells / kChildren, 1});
  return attempts;
}

/// An automatic fit, in normalized coordinates.
class AutomaticFit {
 public:
  AutomaticFit(const TriangleMesh& target, const AutomaticFitOptions& options)
      : options_((check(options), options)),
        original_(target),
        target_(target),
        runner_({SolverKind::newton, options.max_iterations, options.time_limit_seconds, options.progress,
                 options.cancelled, options.log}) {}
  AutomaticFitResult run();

 private:
  bool run_attempt(const Attempt& attempt);
  bool make_template(const Attempt& attempt);
  std::optional<VolumeMesh> make_pillowed(std::size_t cells);
  bool fit_level(int level, const QualitySchedule& schedule, const char* what);
  bool find_creases(int level);
  void set_caps(QualityEnergy& energy, int level) const;
  void refine();
  void judge(AutomaticFitTrial trial);
  void conclude();
  bool is_good() const { return !result_.trials.empty() && result_.trials[result_.chosen].merit == 0; }

  AutomaticFitOptions options_;
  const TriangleMesh& original_;
  FitTarget target_;
  VolumeMesh mesh_;
  FollowedCreases creases_;
  AutomaticFitResult result_;
  double fraction_ = 0;
  double least_share_ = 1;         ///< of the goal that the last level reached, at caps of the lower goal there
  StageRunner runner_;
};

std::optional<VolumeMesh> AutomaticFit::make_pillowed(std::size_t cells) {
  AutoTemplateOptions options{.cells = cells, .pillow = true};
  options.progress = [this](double fraction) {
    return !runner_.is_to_end() && (!options_.progress || options_.progress({"template", 0, 0, fraction, fraction_}));
  };
  AutoTemplateResult made = auto_templates(original_, options, 1);
  result_.topology = made.wanted;
  if (made.cancelled) return std::nullopt;
  if (made.templates.empty())
    throw InputError("target: no grid that was tried, of up to 20 times " + std::to_string(cells) + " cells, has its " +
                     to_string(made.wanted) + "; give a --template");
  return std::move(made.templates.front().mesh);
}

/// Makes a template of at most as many cells as the attempt allows, if there is one. Returns false if the fit must end.
bool AutomaticFit::make_template(const Attempt& attempt) {
  constexpr int kTries = 3;
  double asked = kRoomForTemplates * static_cast<double>(attempt.template_cells);
  for (int trial = 0; trial < kTries; ++trial) {
    const auto count = std::clamp(static_cast<std::size_t>(asked), kLeastTemplateCells, kMostTemplateCells);
    std::optional<VolumeMesh> made = make_pillowed(count);
    if (!made) {
      if (runner_.in_time("the template", result_.report)) {
        result_.report.stop_reason = StopReason::cancelled;
        result_.report.explanation = "cancelled in the template";
      }
      return false;
    }
    mesh_ = std::move(*made);
    if (mesh_.num_cells() <= attempt.template_cells || count == kLeastTemplateCells) break;
    asked *= 0.97 * static_cast<double>(attempt.template_cells) / static_cast<double>(mesh_.num_cells());
  }
  target_.normalisation.take_in(mesh_);
  return true;
}

void AutomaticFit::set_caps(QualityEnergy& energy, int) const {
  // A pillow puts every sharp edge between two cells, and every corner of a cube between three.
  constexpr double kEdgeCap = 0.6, kCornerCap = 0.55;
  std::vector<EdgeCap> edges;
  std::vector<VertexCap> corners;
  for (const CreaseEdge& crease : mesh_.tags.creases) edges.push_back({{crease.v0, crease.v1}, kEdgeCap});
  for (const CornerVertex& corner : mesh_.tags.corners) corners.push_back({corner.vertex, kCornerCap});
  energy.set_caps(edges, corners);
}

/// Fits the present mesh. Returns false if the fit must end.
bool AutomaticFit::fit_level(int level, const QualitySchedule& schedule, const char* what) {
  constexpr int kIntervals = 2, kSamplesPerQuad = 4;
  const std::size_t faces = MeshTopology(mesh_).boundary_faces().size();
  const double h = std::sqrt(target_.surface.area() / static_cast<double>(faces));
  const std::vector<Vec3> lengths(mesh_.num_cells(), Vec3::Constant(h));
  BoundarySamples samples =
      make_boundary_samples(ElementSpace(mesh_, Basis::legendre, 1), kIntervals, mesh_.tags.creases);
  target_.sample(kSamplesPerQuad * faces, 1);
  const auto creases = [&](double width) {
    return creases_.energy(samples.crease_edges, samples.points.size(), width, kQualityTangentialWeight);
  };
  QualityStages stages(mesh_, lengths, identity_map(mesh_.num_vertices()), {},
                       {std::move(samples.positions), {}, samples.triangles, samples.triangle_faces}, target_.surface,
                       mesh_.tags.creases.empty() ? std::function<CreaseEnergy(double)>{} : creases);
  set_caps(stages.energy(), level);
  StageRecord record;
  record.name = formatted("%zu cells, level %d%s", mesh_.num_cells(), level, what);
  record.level = level;
  record.cells = mesh_.num_cells();
  const bool going = stages.run(schedule, runner_, record, fraction_, mesh_.positions, result_.report);
  least_share_ = stages.state().cells.least_share;
  return going;
}

/// Looks for the sharp edges of the target on a mesh that was fitted without them. Returns false if the fit must end.
bool AutomaticFit::find_creases(int level) {
  if (!fit_level(level, smooth_quality_schedule(), ", without creases")) return false;
  creases_ = FollowedCreases(target_.mesh, *options_.crease_angle_degrees, mesh_);
  return true;
}

void AutomaticFit::refine() {
  VolumeMesh fine = smooth_refinement(mesh_);
  creases_.refine(parents_of_creases(fine.tags, mesh_.tags));
  mesh_ = std::move(fine);
}

/// Measures the present mesh and keeps it if it is the best.
void AutomaticFit::judge(AutomaticFitTrial trial) {
  constexpr double kQualityWeight = 5;
  const QualityReport quality = measure_quality(mesh_);
  const TriangleMesh surface = refined_triangles(boundary_surface(mesh_, MeshTopology(mesh_)));
  const SurfaceDistance distance = target_.distance(surface);
  trial.cells = mesh_.num_cells();
  trial.mean_percent = 100 * distance.mean();
  trial.max_percent = 100 * distance.max();
  trial.least_scaled_jacobian = quality.min_scaled_jacobian;
  trial.mean_scaled_jacobian = quality.mean_scaled_jacobian;
  trial.least_share = least_share_;
  trial.uncertified = quality.certificate.not_certified.size();
  trial.self_intersections = runner_.intersecting_pairs(surface, result_.report).value_or(0);
  trial.merit = std::max(0.0, trial.max_percent / options_.max_tolerance_percent - 1) +
                std::max(0.0, trial.mean_percent / options_.mean_tolerance_percent - 1) +
                kQualityWeight * (1 - trial.least_share) +
                (trial.self_intersections > 0 ? 1 : 0) + (trial.uncertified > 0 ? 10 : 0);
  result_.trials.push_back(trial);
  if (result_.trials.size() > 1 && trial.merit >= result_.trials[result_.chosen].merit) return;
  result_.chosen = result_.trials.size() - 1;
  result_.mesh = mesh_;
}

/// Returns false if the fit must end.
bool AutomaticFit::run_attempt(const Attempt& attempt) {
  creases_ = {};
  if (!make_template(attempt)) return false;
  AutomaticFitTrial trial{.template_cells = mesh_.num_cells()};
  const bool has_edges = options_.crease_angle_degrees &&
                         !feature_curves(target_.mesh, *options_.crease_angle_degrees).empty();
  bool going = !has_edges || find_creases(0);
  for (int level = 0; going && level <= attempt.levels; ++level) {
    if (level > 0) refine();
    trial.level = level;
    QualitySchedule schedule =
        level == 0 ? coarse_quality_schedule(options_.quality) : fine_quality_schedule(options_.quality);
    if (level == attempt.levels) schedule.most_distance = kMaxMargin * options_.max_tolerance_percent / 100;
    going = fit_level(level, schedule, "");
  }
  if (going || result_.trials.empty()) judge(trial);
  return going;
}

void AutomaticFit::conclude() {
  FitReport& report = result_.report;
  const AutomaticFitTrial& best = result_.trials[result_.chosen];
  const std::string found =
      formatted("least scaled Jacobian %.3f, mean distance %.4g %%, largest %.4g %%", best.least_scaled_jacobian,
                best.mean_percent, best.max_percent);
  report.explanation = found;
  if (best.merit > 0)
    report.warnings.push_back(formatted("not as good as aimed at (quality %.2f, distances %.3g and %.3g %%): ",
                                        options_.quality, options_.mean_tolerance_percent,
                                        options_.max_tolerance_percent) + found);
}

AutomaticFitResult AutomaticFit::run() {
  const std::vector<Attempt> attempts = attempts_of(options_);
  bool going = true;
  for (std::size_t i = 0; i < attempts.size() && going && !is_good(); ++i) {
    fraction_ = static_cast<double>(i) / static_cast<double>(attempts.size());
    going = run_attempt(attempts[i]);
  }
  if (going) conclude();
  result_.mesh.positions = target_.normalisation.from_unit(std::move(result_.mesh.positions));
  result_.report.seconds = {{"total", runner_.seconds()}};
  return std::move(result_);
}

}  // namespace

AutomaticFitResult fit_automatically(const TriangleMesh& target, const AutomaticFitOptions& options) {
  return AutomaticFit(target, options).run();
}

}  // namespace subvol
