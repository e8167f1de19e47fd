// SPDX-License-Identifier: GPL-3.0-or-later
// Whole fits with and without each accelerator: Newton against L-BFGS, closest points against Voronoi cells, one
// against all threads. JSON to stdout. Usage: bench_fit [TARGET TEMPLATE [LEVELS]]; without arguments the torus sample,
// level 2.
#include "samples/shapes.h"
#include "subvol/fit/geometry/boundary_triangles.h"
#include "subvol/fit/geometry/closest_point.h"
#include "subvol/fit/geometry/surface_distance.h"
#include "subvol/fit/subdivision_fit.h"
#include "subvol/io/mesh_io.h"
#include "subvol/io/surface_io.h"
#include "subvol/mesh/mesh_topology.h"
#include "subvol/surface/boundary.h"

#include <omp.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>

using namespace subvol;
using namespace subvol::internal;

int main(int argc, char** argv) {
  samples::Sample sample = samples::torus_sample();
  FitOptions base;
  base.levels = argc > 3 ? std::atoi(argv[3]) : 2;
  if (argc > 2) {
    sample.target = read_triangle_mesh(argv[1]);
    sample.template_mesh = read_volume_mesh(argv[2]);
  }
  struct Variant {
    const char* name;
    SolverKind solver;
    Correspondence correspondence;
    int threads;
  };
  const int all = omp_get_max_threads();
  const Variant variants[] = {
      {"default", SolverKind::newton, Correspondence::closest, all},
      {"one thread", SolverKind::newton, Correspondence::closest, 1},
      {"voronoi cells", SolverKind::newton, Correspondence::voronoi, all},
      {"lbfgs", SolverKind::lbfgs, Correspondence::closest, all},
      {"lbfgs, voronoi cells", SolverKind::lbfgs, Correspondence::voronoi, all},
  };
  double reference = 0;
  std::printf("{\"bench\": \"fit\", \"levels\": %d, \"rows\": [", base.levels);
  for (const Variant& variant : variants) {
    omp_set_num_threads(variant.threads);
    FitOptions options = base;
    options.solver = variant.solver;
    options.correspondence = variant.correspondence;
    const auto start = std::chrono::steady_clock::now();
    const FitResult result = fit_subdivision_volume(sample.target, sample.template_mesh, options);
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    if (reference == 0) reference = seconds;
    const TriangleMesh boundary = refined_triangles(boundary_surface(result.mesh, MeshTopology(result.mesh)));
    const double mean = 100 * surface_distance(boundary, sample.target).mean() / bounding_box_diagonal(sample.target);
    const auto& last = result.report.stages.back().iterations;
    std::printf(
        "%s\n {\"variant\": \"%s\", \"seconds\": %.3f, \"ratio_to_default\": %.2f, \"mean_percent\": %.4f, "
        "\"surface_energy\": %.6g, \"volume_energy\": %.6g, \"stop\": \"%s\"}",
        &variant == variants ? "" : ",", variant.name, seconds, seconds / reference, mean,
        last.empty() ? 0.0 : last.back().surface_energy, last.empty() ? 0.0 : last.back().volume_energy,
        to_string(result.report.stop_reason));
    std::fflush(stdout);
  }
  std::printf("\n]}\n");
}
