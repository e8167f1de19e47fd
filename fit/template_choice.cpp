// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/template_choice.h"

#include "subvol/base/error.h"
#include "subvol/base/option_checks.h"
#include "subvol/fit/elements/boundary_samples.h"
#include "subvol/fit/geometry/boundary_triangles.h"
#include "subvol/fit/geometry/closest_point.h"
#include "subvol/fit/geometry/self_intersection.h"
#include "subvol/fit/geometry/surface_distance.h"
#include "subvol/fit/high_order_fit.h"
#include "subvol/fit/mending/surface_repair.h"
#include "subvol/fit/quality/high_order_quality.h"
#include "subvol/fit/quality/quality.h"
#include "subvol/fit/subdivision_fit.h"
#include "subvol/mesh/mesh_topology.h"
#include "subvol/surface/boundary.h"
#include "subvol/templates/auto_template.h"

#include <algorithm>
#include <chrono>

namespace subvol {

using namespace internal;

namespace {

constexpr double kGoodMaxPercent = 1.5, kGoodMeanPercent = 0.15, kGoodShape = 0.9, kShapeWeight = 5;
constexpr double kLeastSeconds = 1e-3;  // time for a trial if the limit has been reached

class Chooser {
 public:
  Chooser(const TriangleMesh& target, const TemplateChoiceOptions& options)
      : target_(target), options_(options), tree_(target), diagonal_(bounding_box_diagonal(target)) {}
  TemplateChoice run();

 private:
  bool tell(const char* stage, double fraction) const {
    return !options_.progress || options_.progress({stage, 0, 0, 0, fraction});
  }
  /// The surface of a template fitted for a few steps, and the shape of its cells.
  struct ShortFit {
    TriangleMesh surface;
    double mean_scaled_jacobian;
  };
  std::function<bool(const FitProgress&)> trial_progress(std::function<bool()> goes_on = {});
  ShortFit fit_subdivided(const VolumeMesh& mesh);
  ShortFit fit_curved(const VolumeMesh& mesh);
  std::vector<AutoTemplate> candidates(std::size_t cells, bool pillow, std::size_t most);
  bool try_count(std::size_t cells);
  bool try_template(VolumeMesh mesh, bool pillowed);
  double seconds() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }
  /// Returns the time for the next trial; 0: no limit.
  double time_left() const {
    const double limit = options_.time_limit_seconds;
    return limit > 0 ? std::max(kLeastSeconds, limit - seconds()) : 0;
  }
  bool is_over() const {
    return !choice_.trials.empty() && options_.time_limit_seconds > 0 && seconds() > options_.time_limit_seconds;
  }

  const TriangleMesh& target_;
  const TemplateChoiceOptions& options_;
  ClosestPoint tree_;
  double diagonal_;
  TemplateChoice choice_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

std::vector<AutoTemplate> Chooser::candidates(std::size_t cells, bool pillow, std::size_t most) {
  AutoTemplateOptions options{.cells = cells, .pillow = pillow};
  options.progress = [this](double fraction) { return tell("template", fraction); };
  AutoTemplateResult result = auto_templates(target_, options, most);
  choice_.cancelled |= result.cancelled;
  choice_.topology = result.wanted;
  return std::move(result.templates);
}

/// Returns true if the core inside the pillow is several cells thick: a cube of 3 x 3 x 3 cells has two faces per cell.
bool has_thick_core(const VolumeMesh& pillowed) {
  constexpr double kMostFacesPerCell = 1.9;
  const std::size_t faces = MeshTopology(pillowed).boundary_faces().size();
  return static_cast<double>(faces) <= kMostFacesPerCell * static_cast<double>(pillowed.num_cells() - faces);
}

/// Returns a callback that reports a trial's progress and ends the trial if the caller cancels or goes_on() is false.
std::function<bool(const FitProgress&)> Chooser::trial_progress(std::function<bool()> goes_on) {
  return [this, goes_on = std::move(goes_on)](const FitProgress& progress) {
    FitProgress told = progress;
    told.stage = "trying a template";
    choice_.cancelled = choice_.cancelled || (options_.progress && !options_.progress(told));
    return !choice_.cancelled && (!goes_on || goes_on());
  };
}

Chooser::ShortFit Chooser::fit_subdivided(const VolumeMesh& mesh) {
  constexpr int kMostSteps = 10;  // enough to distinguish templates; the fit itself starts afresh
  int steps = 0;
  FitOptions options{.levels = 1, .crease_angle_degrees = options_.crease_angle_degrees};
  options.quality = 0;  // it would cost more than the trial and tells little about the template
  options.time_limit_seconds = time_left();
  options.progress = trial_progress([&] { return ++steps <= kMostSteps; });
  options.cancelled = options_.cancelled;
  const FitResult fit = fit_subdivision_volume(target_, mesh, options);
  return {refined_triangles(boundary_surface(fit.mesh, MeshTopology(fit.mesh))),
          measure_quality(fit.mesh).mean_scaled_jacobian};
}

Chooser::ShortFit Chooser::fit_curved(const VolumeMesh& mesh) {
  constexpr int kMostOrder = 2, kMostSteps = 6, kIntervals = 6;
  HighOrderFitOptions options{.order = std::min(options_.order, kMostOrder), .basis = options_.basis};
  options.improve_worst_places = false;
  options.max_iterations = kMostSteps;
  options.time_limit_seconds = time_left();
  options.progress = trial_progress();
  options.cancelled = options_.cancelled;
  const HighOrderMesh fitted = fit_high_order(target_, mesh, options).mesh;
  BoundarySamples samples = make_boundary_samples(fitted.space, kIntervals);
  return {{samples.positions.apply(fitted.coefficients), std::move(samples.triangles)},
          measure_quality(fitted).mean_scaled_jacobian};
}

/// Fits a template for a few steps and records the outcome. Returns false if canceled.
bool Chooser::try_template(VolumeMesh mesh, bool pillowed) {
  const auto [surface, mean_scaled_jacobian] = options_.order > 0 ? fit_curved(mesh) : fit_subdivided(mesh);
  TemplateTrial trial{.cells = mesh.num_cells(), .pillowed = pillowed};
  trial.self_intersections = count_intersecting_pairs(surface, options_.cancelled);
  choice_.cancelled = choice_.cancelled || (options_.cancelled && options_.cancelled());
  if (choice_.cancelled) return false;
  const SurfaceDistance distance = surface_distance(surface, ClosestPoint(surface), target_, tree_);
  trial.mean_percent = 100 * distance.mean() / diagonal_;
  trial.max_percent = 100 * distance.max() / diagonal_;
  trial.mean_scaled_jacobian = mean_scaled_jacobian;
  trial.merit = trial.max_percent / kGoodMaxPercent + trial.mean_percent / kGoodMeanPercent +
                kShapeWeight * std::max(0.0, kGoodShape - trial.mean_scaled_jacobian) +
                (trial.self_intersections > 0 ? 1 : 0);
  choice_.trials.push_back(trial);
  if (choice_.mesh.num_cells() == 0 || trial.merit < choice_.trials[choice_.chosen].merit) {
    choice_.chosen = choice_.trials.size() - 1;
    choice_.mesh = std::move(mesh);
  }
  return true;
}

/// Tries templates of about this many cells. Returns false if canceled.
bool Chooser::try_count(std::size_t cells) {
  constexpr std::size_t kPlain = 2;
  std::vector<AutoTemplate> plain = candidates(cells, false, kPlain);
  if (choice_.cancelled) return false;
  if (plain.empty())
    throw InputError("target: " + why_no_grid(target_, cells, choice_.topology, options_.cancelled) + "; give a --template");
  if (plain.front().cells_asked != cells)
    choice_.warnings.push_back(std::to_string(cells) + " cells cannot carry the target's " +
                               to_string(choice_.topology) + "; the template is made for " +
                               std::to_string(plain.front().cells_asked));
  for (AutoTemplate& candidate : plain)
    if (!is_over() && !try_template(std::move(candidate.mesh), false)) return false;
  if (is_over()) return true;
  std::vector<AutoTemplate> pillowed = candidates(cells, true, 1);
  if (choice_.cancelled) return false;
  if (pillowed.empty() || pillowed.front().cells_asked != cells || !has_thick_core(pillowed.front().mesh)) return true;
  return try_template(std::move(pillowed.front().mesh), true);
}

TemplateChoice Chooser::run() {
  std::vector<std::size_t> counts{kFirstCells, kSecondCells, kLastCells};
  if (options_.cells) counts = {*options_.cells};
  for (std::size_t cells : counts) {
    if (!try_count(cells)) {
      choice_.mesh = {};
      break;
    }
    const TemplateTrial& best = choice_.trials[choice_.chosen];
    if (is_over() || (best.self_intersections == 0 && best.max_percent <= kGoodMaxPercent)) break;
  }
  return std::move(choice_);
}

}  // namespace

TemplateChoice choose_template(const TriangleMesh& target, const TemplateChoiceOptions& options) {
  require_in_range("TemplateChoiceOptions", "order", options.order, 0, kMaxOrder);
  require_in_range("TemplateChoiceOptions", "time_limit_seconds", options.time_limit_seconds, 0, 1e12);
  return Chooser(target, options).run();
}

}  // namespace subvol
