// SPDX-License-Identifier: GPL-3.0-or-later
// Times of building and applying the subdivision matrix, level by level, and of refining a boundary.
#include "bench/hex_grid.h"
#include "subvol/mesh/mesh_topology.h"
#include "subvol/subdivision/limit_surface.h"
#include "subvol/subdivision/subdivision.h"

#include <omp.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>

using namespace subvol;

namespace {

/// Least seconds of a few runs.
template <class Run>
double best_seconds(int repeats, const Run& run) {
  double best = 1e300;
  for (int i = 0; i < repeats; ++i) {
    const auto start = std::chrono::steady_clock::now();
    run();
    const std::chrono::duration<double> time = std::chrono::steady_clock::now() - start;
    best = std::min(best, time.count());
  }
  return best;
}

void print_level(const VolumeMesh& control, int level, bool last) {
  SubdivisionLevel refined;
  const double build = best_seconds(5, [&] { subdivision_matrix(control); });
  const double refine = best_seconds(3, [&] { refined = subdivide(control); });
  const double topology = best_seconds(3, [&] { MeshTopology{control}; });
  std::vector<Vec3> fine(refined.matrix.num_rows()), back(refined.matrix.num_cols);
  const double apply = best_seconds(10, [&] { refined.matrix.apply(control.positions, fine); });
  const double transposed = best_seconds(5, [&] { refined.matrix.apply_transposed(fine, back); });
  const double vertices = static_cast<double>(fine.size()), cells = static_cast<double>(refined.fine.num_cells());
  std::printf("    {\"level\": %d, \"cells\": %zu, \"vertices\": %zu, \"nonzeros_per_row\": %.2f,\n", level,
              refined.fine.num_cells(), fine.size(), refined.matrix.num_nonzeros() / vertices);
  std::printf("     \"build_million_cells_per_second\": %.2f, \"refine_million_cells_per_second\": %.2f,\n",
              cells / build * 1e-6, cells / refine * 1e-6);
  std::printf("     \"control_topology_seconds\": %.4f,\n", topology);
  std::printf("     \"apply_ns_per_vertex\": %.2f, \"apply_transposed_ns_per_vertex\": %.2f}%s\n",
              apply / vertices * 1e9, transposed / vertices * 1e9, last ? "" : ",");
}

}  // namespace

/// bench_subdivision [levels = 3]: of a grid of 8^3 hexes.
int main(int argc, char** argv) {
  const int levels = argc > 1 ? std::atoi(argv[1]) : 3;
  VolumeMesh mesh = bench::hex_grid(8);
  const VolumeMesh coarse = mesh;
  std::printf("{\n  \"threads\": %d,\n  \"subdivide\": [\n", omp_get_max_threads());
  for (int level = 1; level <= levels; ++level) {
    print_level(mesh, level, level == levels);
    if (level < levels) mesh = subdivide(mesh).fine;
  }
  std::printf("  ],\n  \"refine_boundary\": [\n");
  for (int level = 0; level <= 3; ++level) {
    BoundaryRefinement refined;
    const double seconds = best_seconds(3, [&] { refined = refine_boundary(coarse, level); });
    const double tangents = best_seconds(3, [&] { refine_boundary(coarse, level, true); });
    std::printf("    {\"levels\": %d, \"quads\": %zu, \"seconds\": %.4f, \"with_tangents_seconds\": %.4f}%s\n", level,
                refined.quads.size(), seconds, tangents, level == 3 ? "" : ",");
  }
  std::printf("  ]\n}\n");
}
