// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/high_order_fit.h"

#include "fit/boundary_samples.h"
#include "fit/boundary_triangles.h"
#include "fit/fit_level.h"
#include "fit/fit_target.h"
#include "fit/high_order_energy.h"
#include "fit/quadrature.h"
#include "fit/stage_runner.h"
#include "subvol/boundary.h"
#include "subvol/error.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace subvol {

namespace {

constexpr double kCoarseLambda = 0.05, kFarTangentialWeight = 0.1, kCloseTangentialWeight = 0.003;
constexpr int kMaxIterations = 40;

template <class... Values>
std::string format(const char* form, Values... values) {
  char text[160];
  std::snprintf(text, sizeof text, form, values...);
  return text;
}

HighOrderFitOptions checked(const HighOrderFitOptions& options) {
  const auto in_range = [](const char* name, double value, double low, double high) {
    if (!(value >= low && value <= high))
      throw InputError(format("HighOrderFitOptions::%s must be in [%g, %g], got %g", name, low, high, value));
  };
  in_range("order", options.order, 1, kMaxOrder);
  in_range("lambda_close", options.lambda_close, 1e-9, 1e9);
  in_range("max_iterations", options.max_iterations, 0, 1e9);
  in_range("time_limit_seconds", options.time_limit_seconds, 0, 1e12);
  if (options.tolerance_percent) in_range("tolerance_percent", *options.tolerance_percent, 1e-9, 100);
  return options;
}

VolumeMesh checked(VolumeMesh mesh) {
  for (const MeshDefect& defect : validate(mesh))
    if (defect.kind != MeshDefect::Kind::unused_vertex) throw InputError("template mesh: " + defect.message);
  return mesh;
}

/// The high-order fit, in normalised coordinates.
class HighOrderFit {
 public:
  HighOrderFit(const TriangleMesh& target, const VolumeMesh& template_mesh, const HighOrderFitOptions& options);
  HighOrderFitResult run();

 private:
  void look_over_template();
  void raise_order(int order);
  bool run_stage(const Stage& stage);
  void take_own_boxes();
  bool run_order(int order);
  bool lower_lambda();
  double measured_mean();

  HighOrderFitOptions options_;
  FitTarget target_;
  VolumeMesh template_;
  FitSchedule schedule_;
  std::vector<Vec3> ideal_boxes_;
  HighOrderMesh mesh_;
  BoundarySamples samples_;
  int order_ = 1;
  double lambda_ = 0;
  std::optional<double> mean_;  ///< percent, of the current state
  FitReport report_;
  StageRunner runner_;
};

HighOrderFit::HighOrderFit(const TriangleMesh& target, const VolumeMesh& template_mesh,
                           const HighOrderFitOptions& options)
    : options_(checked(options)),
      target_(target),
      template_(checked(template_mesh)),
      mesh_(ElementSpace(template_, options.basis, 1), template_),
      runner_({options.solver, options.max_iterations, options.time_limit_seconds, options.progress}) {
  template_.positions = mesh_.coefficients = target_.normalisation.to_unit(std::move(template_.positions));
}

void HighOrderFit::look_over_template() {
  const double distance =
      target_.compare_start(refined_triangles(boundary_surface(template_, MeshTopology(template_))), report_);
  FitOptions options;
  options.levels = options_.order;
  options.lambda_close = options_.lambda_close;
  schedule_ = make_schedule(options, distance / target_.surface.length());
  ideal_boxes_ = ideal_boxes(template_, template_.positions, target_.surface.volume(), schedule_.own_box_shares[0]);
}

void HighOrderFit::raise_order(int order) {
  constexpr int kMostIntervals = 16;
  order_ = order;
  mesh_ = mesh_.with_orders(EntityOrders::uniform(mesh_.space.topology(), order));
  const double faces = static_cast<double>(mesh_.space.topology().boundary_faces().size());
  const double triangles = static_cast<double>(target_.surface.triangles().size());
  const int wanted = static_cast<int>(std::ceil(std::sqrt(triangles / faces)));
  samples_ = make_boundary_samples(mesh_.space, std::max(std::min(wanted, kMostIntervals), 2 * order));
  target_.sample(samples_.points.size());
  mean_.reset();
}

bool HighOrderFit::run_stage(const Stage& stage) {
  constexpr int kLeastPoints = 5;
  StageRecord record;
  record.name = format("order %d, lambda %g, tangential weight %g", order_, stage.lambda, stage.tangential_weight);
  record.order = order_;
  record.cells = mesh_.space.num_cells();
  lambda_ = stage.lambda;
  const std::vector<int> points(mesh_.space.num_cells(), std::max(kLeastPoints, points_for_order(order_)));
  FitProblem problem(identity_map(mesh_.space.num_nodes()), samples_.positions,
                     std::make_unique<HighOrderEnergy>(mesh_.space, ideal_boxes_, points),
                     make_surface_term(target_.surface, samples_.triangles, samples_.points.size(),
                                       stage.tangential_weight, options_.correspondence),
                     stage.lambda);
  mean_.reset();
  return runner_.run(problem, stage, std::move(record), schedule_.fraction(order_), mesh_.coefficients, report_);
}

double HighOrderFit::measured_mean() {
  if (!mean_) {
    const BoundarySamples fine = make_boundary_samples(mesh_.space, 3 * order_ + 4);
    mean_ = 100 * target_.mean_distance({fine.positions.apply(mesh_.coefficients), fine.triangles});
    if (!report_.stages.empty()) report_.stages.back().mean_distance_percent = *mean_;
  }
  return *mean_;
}

/// From now on, cells are ideal as boxes of the size they have: graded meshes stay graded.
void HighOrderFit::take_own_boxes() {
  ideal_boxes_ = ideal_boxes(template_, std::span(mesh_.coefficients).first(template_.num_vertices()),
                             target_.surface.volume(), 1);
}

/// Far templates need their curves before their own boxes tell what their cells should look like.
bool HighOrderFit::run_order(int order) {
  constexpr int kLastCommonOrder = 2;
  const bool far = schedule_.own_box_shares[0] < 1;
  if (order > (far ? kLastCommonOrder : 1)) take_own_boxes();
  raise_order(order);
  const bool last = order == options_.order;
  if (order == 1 && !run_stage({kCoarseLambda, kFarTangentialWeight})) return false;
  if (last && far && order > 1 && order <= kLastCommonOrder) {
    if (!run_stage({kCoarseLambda, kCloseTangentialWeight, kMaxIterations})) return false;
    take_own_boxes();
  }
  return run_stage({last ? options_.lambda_close : kCoarseLambda, kCloseTangentialWeight, kMaxIterations}) &&
         (!last || lower_lambda());
}

bool HighOrderFit::lower_lambda() {
  if (!options_.tolerance_percent) return true;
  for (double lambda = lambda_ / 2; measured_mean() > *options_.tolerance_percent && lambda > 1e-3 * options_.lambda_close;
       lambda /= 2) {
    const double before = measured_mean();
    if (!run_stage({lambda, kCloseTangentialWeight, kMaxIterations})) return false;
    if (1 - measured_mean() / before < kLeastGain) break;
  }
  return true;
}

HighOrderFitResult HighOrderFit::run() {
  look_over_template();
  bool going = true;
  for (int order = 1; going; order = std::min(2 * order, options_.order)) {
    going = run_order(order);
    if (order == options_.order) break;
  }
  if (going) {
    const bool missed = options_.tolerance_percent && measured_mean() > *options_.tolerance_percent;
    report_.stop_reason = missed ? StopReason::tolerance_missed : StopReason::converged;
    report_.explanation = missed ? format("mean distance %.4g %% is above the tolerance of %.4g %%", measured_mean(),
                                          *options_.tolerance_percent)
                                 : format("all stages done, mean distance %.4g %%", measured_mean());
  }
  report_.seconds = {{"total", runner_.seconds()}};
  const std::size_t num_vertices = mesh_.space.num_vertices();
  std::vector<Vec3>& x = mesh_.coefficients;
  for (std::size_t i = 0; i < x.size(); ++i)
    x[i] = target_.normalisation.diagonal * x[i] + (i < num_vertices ? target_.normalisation.centre : Vec3(0, 0, 0));
  return {std::move(mesh_), std::move(report_)};
}

}  // namespace

HighOrderFitResult fit_high_order(const TriangleMesh& target, const VolumeMesh& template_mesh,
                                  const HighOrderFitOptions& options) {
  return HighOrderFit(target, template_mesh, options).run();
}

}  // namespace subvol
