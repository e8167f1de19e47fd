// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/subdivision_fit.h"

#include "fit/certificate.h"
#include "fit/fit_level.h"
#include "fit/fit_problem.h"
#include "fit/surface_distance.h"
#include "fit/target_surface.h"
#include "subvol/boundary.h"
#include "subvol/error.h"
#include "subvol/features.h"
#include "subvol/limit_surface.h"
#include "subvol/mesh_topology.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>

namespace subvol {

namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

/// One minimisation of the schedule.
struct Stage {
  double lambda, tangential_weight;
  int max_iterations = 20;
  double relative_decrease = 1e-3;
};

std::string stage_name(int level, const Stage& stage) {
  char text[96];
  std::snprintf(text, sizeof text, "level %d, lambda %g, tangential weight %g", level, stage.lambda,
                stage.tangential_weight);
  return text;
}

class SubdivisionFit {
 public:
  SubdivisionFit(const TriangleMesh& target, const VolumeMesh& template_mesh, const FitOptions& options);
  FitResult run();

 private:
  bool start_level(FitLevel& level, int number);
  bool run_stage(FitLevel& level, int number, const Stage& stage, std::string name = "");
  std::unique_ptr<FitProblem> make_problem(const FitLevel& level, const SparseMap& nodes, int number,
                                           const Stage& stage) const;
  std::vector<Stage> stages_of(int number) const;
  bool out_of_time() const { return options_.time_limit_seconds > 0 && seconds_since(start_) > options_.time_limit_seconds; }

  FitOptions options_;
  TargetSurface target_;
  VolumeMesh control_;             ///< the control mesh (its last refinement, for cage-only fits)
  SparseMap from_unknowns_;        ///< unknowns to control_'s vertices
  SparseMap previous_nodes_;       ///< unknowns to the nodes of the last certified finite element mesh
  std::vector<Vec3> unknowns_;
  std::vector<double> sizes_;      ///< ideal sizes of the current level's cells
  FitReport report_;
  Clock::time_point start_ = Clock::now();
};

SubdivisionFit::SubdivisionFit(const TriangleMesh& target, const VolumeMesh& template_mesh, const FitOptions& options)
    : options_(options), target_(target), control_(template_mesh) {
  const auto in_range = [](const char* name, double value, double low, double high) {
    if (!(value >= low && value <= high))
      throw InputError(std::string("FitOptions::") + name + " must be in [" + std::to_string(low) + ", " +
                       std::to_string(high) + "], got " + std::to_string(value));
  };
  in_range("levels", options.levels, 1, 6);
  in_range("lambda_far", options.lambda_far, 1e-9, 1e9);
  in_range("lambda_close", options.lambda_close, 1e-9, 1e9);
  if (options.tolerance_percent) in_range("tolerance_percent", *options.tolerance_percent, 1e-9, 100);
  for (const MeshDefect& defect : validate(template_mesh))
    if (defect.kind != MeshDefect::Kind::unused_vertex)
      throw InputError("template mesh: " + defect.message);
  if (options.crease_angle_degrees)
    control_.tags = merge_tags(control_.tags, features_by_angle(control_, *options.crease_angle_degrees));
  unknowns_ = control_.positions;
  from_unknowns_ = identity_map(unknowns_.size());
  previous_nodes_ = from_unknowns_;
}

std::vector<Stage> SubdivisionFit::stages_of(int number) const {
  std::vector<Stage> stages;
  const double close = options_.lambda_close, coarse = std::max(0.05, close);
  if (number == 1) {
    stages.push_back({coarse, 0.1});
    stages.push_back({coarse, 0.003});
  } else {
    stages.push_back({coarse, 0.003});
  }
  if (number == options_.levels && close < coarse) stages.push_back({close, 0.003});
  return stages;
}

std::unique_ptr<FitProblem> SubdivisionFit::make_problem(const FitLevel& level, const SparseMap& nodes, int number,
                                                         const Stage& stage) const {
  // Nested quadrature: the points of a level are among those of its parents, so no child starts inverted at one.
  const int points = number == 1 ? 5 : number == 2 ? 3 : 2;
  return std::make_unique<FitProblem>(nodes, level.samples, level.mesh, VolumeEnergy(level.mesh, sizes_, points),
                                      SurfaceEnergy(target_, level.sample_triangles, level.samples.num_rows(),
                                                    stage.tangential_weight),
                                      stage.lambda);
}

bool SubdivisionFit::run_stage(FitLevel& level, int number, const Stage& stage, std::string name) {
  const Clock::time_point begin = Clock::now();
  StageRecord record;
  record.name = name.empty() ? stage_name(number, stage) : name;
  record.level = number;
  record.lambda = stage.lambda;
  record.tangential_weight = stage.tangential_weight;
  record.unknowns = unknowns_.size();
  record.cells = level.mesh.num_cells();
  auto problem = make_problem(level, level.nodes, number, stage);
  MinimizerOptions options;
  options.max_iterations = options_.max_iterations > 0 ? options_.max_iterations : stage.max_iterations;
  options.relative_decrease = stage.relative_decrease;
  bool cancelled = false, timed_out = false;
  int iteration = 0;
  options.progress = [&](const IterationRecord& r) {
    timed_out = out_of_time();
    if (options_.progress)
      cancelled = !options_.progress({record.name.c_str(), number, ++iteration,
                                      r.surface_energy + stage.lambda * r.volume_energy,
                                      double(number - 1) / options_.levels});
    return !cancelled && !timed_out;
  };
  MinimizerResult result = minimize_newton(*problem, unknowns_, options);
  record.iterations = std::move(result.iterations);
  record.stop = result.explanation;
  record.seconds = seconds_since(begin);
  if (std::getenv("SUBVOL_TRACE")) {
    int cg = 0;
    for (auto& r : record.iterations) cg += r.linear_iterations;
    std::fprintf(stderr, "%-50s its %2zu cg %4d E_S %.4g E_W %.4g %.2fs %s\n", record.name.c_str(), record.iterations.size(), cg,
                 record.iterations.empty() ? 0 : record.iterations.back().surface_energy,
                 record.iterations.empty() ? 0 : record.iterations.back().volume_energy, record.seconds,
                 record.stop.c_str());
  }
  report_.stages.push_back(std::move(record));
  if (cancelled) report_.stop_reason = StopReason::cancelled;
  if (timed_out) report_.stop_reason = StopReason::time_limit;
  return !cancelled && !timed_out;
}

/// Makes the level's start valid by continuation from the linear split of the level below:
///   M_t = (1 - t) L + t M, a few steps of the minimiser at each t that is feasible.
bool SubdivisionFit::start_level(FitLevel& level, int number) {
  const Stage stage{0.05, 0.1, 4};
  const SparseMap target_map = level.nodes;
  const auto feasible = [&](double t) {
    return certify(blend(level.safe_nodes, target_map, t).apply(unknowns_), level.mesh).all_certified();
  };
  double t = 0;
  for (int round = 0; round < 40; ++round) {
    double next = 1;
    while (!feasible(next) && next - t > 1e-3) next = t + 0.6 * (next - t);
    if (next - t <= 1e-3) break;
    t = next;
    if (std::getenv("SUBVOL_TRACE")) std::fprintf(stderr, "level %d start t=%g\n", number, t);
    if (t == 1) {
      level.nodes = target_map;
      return true;
    }
    level.nodes = blend(level.safe_nodes, target_map, t);
    char name[64];
    std::snprintf(name, sizeof name, "level %d, continuation t=%.3f", number, t);
    if (!run_stage(level, number, stage, name)) break;
  }
  level.nodes = blend(level.safe_nodes, target_map, t);
  return false;
}

FitResult SubdivisionFit::run() {
  FitResult result;
  double blend = 0.5;
  if (const char* e = std::getenv("SUBVOL_BLEND")) blend = std::atof(e);
  const std::size_t min_samples = target_.triangles().size();
  for (int number = 1; number <= options_.levels; ++number) {
    auto t0 = Clock::now();
    FitLevel level = make_fit_level(control_, from_unknowns_, previous_nodes_, options_, min_samples);
    sizes_ = number == 1 ? child_sizes(control_, target_.volume(), blend) : refined_sizes(sizes_);
    if (std::getenv("SUBVOL_TRACE")) std::fprintf(stderr, "build %.2fs samples %zu\n", seconds_since(t0), level.samples.num_rows());
    bool going = start_level(level, number);
    if (!going && report_.stop_reason == StopReason::converged) {
      report_.stop_reason = StopReason::stalled;
      report_.explanation = "level " + std::to_string(number) + " could not be started without inverting a cell";
    }
    for (const Stage& stage : stages_of(number)) {
      if (!going) break;
      going = run_stage(level, number, stage);
    }
    result.mesh = level.mesh;
    result.mesh.positions = level.nodes.apply(unknowns_);
    if (options_.cage_only) {
      if (number == 1) result.cage = control_;
      result.cage.positions = unknowns_;
      from_unknowns_ = compose(level.refine, from_unknowns_);
      previous_nodes_ = level.nodes;
    } else {
      result.cage = control_;
      result.cage.positions = unknowns_;
      unknowns_ = level.refine.apply(unknowns_);
      from_unknowns_ = identity_map(unknowns_.size());
      previous_nodes_ = options_.surface == FittedSurface::limit ? limit_map(level.mesh) : from_unknowns_;
    }
    VolumeMesh next = std::move(level.mesh);
    control_ = std::move(next);
    control_.positions = from_unknowns_.apply(unknowns_);
    if (!going) break;
  }
  result.report = std::move(report_);
  return result;
}

}  // namespace

const char* to_string(StopReason reason) {
  switch (reason) {
    case StopReason::converged: return "converged";
    case StopReason::tolerance_missed: return "tolerance_missed";
    case StopReason::iteration_limit: return "iteration_limit";
    case StopReason::time_limit: return "time_limit";
    case StopReason::cancelled: return "cancelled";
    case StopReason::stalled: return "stalled";
  }
  return "unknown";
}

FitResult fit_subdivision_volume(const TriangleMesh& target, const VolumeMesh& template_mesh, const FitOptions& options) {
  return SubdivisionFit(target, template_mesh, options).run();
}

}  // namespace subvol
