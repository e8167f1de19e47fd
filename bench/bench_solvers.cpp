// SPDX-License-Identifier: GPL-3.0-or-later
// Newton's method against plain L-BFGS on one problem: the last stage of a fit of curved elements, from the same start
// with the same ideal cells. JSON to stdout: processor time until the energy is within 1 % of the least that either
// finds. Usage: bench_solvers [TARGET TEMPLATE [ORDER]]; without arguments the torus sample, order 4. One thread.
#include "bench/freed_memory.h"
#include "samples/shapes.h"
#include "subvol/fit/elements/boundary_samples.h"
#include "subvol/fit/elements/ideal_boxes.h"
#include "subvol/fit/energies/high_order_energy.h"
#include "subvol/fit/energies/make_surface_term.h"
#include "subvol/fit/fits/high_order_schedule.h"
#include "subvol/fit/high_order_fit.h"
#include "subvol/fit/solver/lbfgs.h"
#include "subvol/fit/solver/newton.h"
#include "subvol/fit/stages/stage_runner.h"
#include "subvol/fit/target/fit_target.h"
#include "subvol/io/mesh_io.h"
#include "subvol/io/surface_io.h"

#include <omp.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>

using namespace subvol;
using namespace subvol::internal;

namespace {

constexpr double kLastStageLambda = 0.05, kNearLeastEnergyRatio = 1.01;
constexpr int kBoundarySampleIntervals = 16, kMostMinimizerSteps = 2000;

struct Run {
  std::vector<double> seconds, energies;  ///< after each step

  double least() const { return *std::min_element(energies.begin(), energies.end()); }
  /// Processor time until the energy is at most this; negative: never.
  double seconds_to(double energy) const {
    const auto step = std::find_if(energies.begin(), energies.end(), [&](double e) { return e <= energy; });
    return step == energies.end() ? -1 : seconds[static_cast<std::size_t>(step - energies.begin())];
  }
};

FitProblem last_stage(const HighOrderMesh& mesh, const VolumeMesh& cells, const FitTarget& target,
                      const BoundarySamples& samples) {
  std::vector<int> points(mesh.space.num_cells(), points_for_order(mesh.space.max_order()));
  const auto vertices = std::span(mesh.coefficients).first(cells.num_vertices());
  FitProblem problem(
      identity_map(mesh.space.num_nodes()), samples.positions,
      std::make_unique<HighOrderEnergy>(mesh.space, ideal_boxes(cells, vertices, target.surface.volume(), 1), points),
      make_surface_term(target.surface, samples.triangles, samples.points.size(),
                        HighOrderSchedule().final_stage(kLastStageLambda).tangential_weight, Correspondence::closest,
                        SurfacePull::straight, 0, samples.at_edges),
      kLastStageLambda);
  problem.tables.emplace(mesh.space, samples.points);
  return problem;
}

template <class Minimizer>
Run timed(Minimizer&& minimize, FitProblem problem, std::vector<Vec3> x) {
  Run run;
  MinimizerOptions options;
  options.max_iterations = kMostMinimizerSteps;
  options.relative_decrease = 1e-5;
  const std::clock_t start = std::clock();
  options.progress = [&](const IterationRecord& step) {
    run.seconds.push_back(static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
    run.energies.push_back(step.surface_energy + kLastStageLambda * step.volume_energy);
    return true;
  };
  minimize(problem, x, options);
  return run;
}

}  // namespace

int main(int argc, char** argv) {
  omp_set_num_threads(1);
  keep_freed_memory();
  samples::Sample sample = samples::torus_sample();
  if (argc > 2) sample = {"", read_triangle_mesh(argv[1]), read_volume_mesh(argv[2])};
  const int order = argc > 3 ? std::atoi(argv[3]) : 4;

  HighOrderFitOptions options;
  options.order = std::max(1, order / 2);
  options.improve_worst_places = false;
  HighOrderMesh mesh = fit_high_order(sample.target, sample.template_mesh, options).mesh;
  mesh = mesh.with_orders(EntityOrders::uniform(mesh.space.topology(), order));
  FitTarget target(sample.target);
  for (std::size_t i = 0; i < mesh.coefficients.size(); ++i) {
    if (i < mesh.space.num_vertices()) mesh.coefficients[i] -= target.normalization.center;
    mesh.coefficients[i] /= target.normalization.diagonal;
  }
  const BoundarySamples samples = make_boundary_samples(mesh.space, kBoundarySampleIntervals);
  target.sample(samples.points.size(), static_cast<std::size_t>(FitTuning{}.least_target_samples));
  const auto problem = [&] { return last_stage(mesh, sample.template_mesh, target, samples); };
  const Run newton = timed(minimize_newton, problem(), mesh.coefficients);
  const Run lbfgs = timed(minimize_lbfgs, problem(), mesh.coefficients);

  const double near = kNearLeastEnergyRatio * std::min(newton.least(), lbfgs.least());
  std::printf("{\"bench\": \"solvers\", \"order\": %d, \"unknowns\": %zu, \"rows\": [", order,
              mesh.coefficients.size());
  const auto print = [&](const char* name, const Run& run) {
    std::printf(
        "\n {\"solver\": \"%s\", \"steps\": %zu, \"least_energy\": %.6g, \"cpu_seconds\": %.3f, "
        "\"seconds_to_1_percent\": %.3f, \"ratio_to_newton\": %.2f}",
        name, run.energies.size(), run.least(), run.seconds.back(), run.seconds_to(near),
        run.seconds_to(near) / newton.seconds_to(near));
  };
  print("newton", newton);
  std::printf(",");
  print("lbfgs", lbfgs);
  std::printf("\n]}\n");
}
