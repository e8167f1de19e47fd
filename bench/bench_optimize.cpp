// SPDX-License-Identifier: GPL-3.0-or-later
#include "bench/hex_grid.h"
#include "subvol/fit/optimize_mesh.h"
#include "subvol/fit/quality/quality.h"
#include "subvol/mesh/mesh_topology.h"

#include <omp.h>

#include <chrono>
#include <cstdio>
#include <random>

using namespace subvol;

namespace {

/// Throws the inner vertices of a grid of n^3 hexes anywhere into its box of side n.
VolumeMesh scrambled_grid(int n) {
  VolumeMesh mesh = bench::hex_grid(n);
  Vec3 low = mesh.positions[0], high = low;
  for (const Vec3& p : mesh.positions) low = low.cwiseMin(p), high = high.cwiseMax(p);
  const MeshTopology topology(mesh);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (std::size_t v = 0; v < mesh.num_vertices(); ++v)
    if (!topology.is_boundary_vertex(static_cast<Index>(v)))
      for (int d = 0; d < 3; ++d) mesh.positions[v][d] = low[d] + uniform(random) * (high[d] - low[d]);
  return mesh;
}

}  // namespace

int main() {
  omp_set_num_threads(1);
  std::printf("{\"threads\": 1, \"optimize\": [");
  const char* separator = "";
  for (const int n : {8, 16, 24})
    for (const bool fixed : {true, false}) {
      const VolumeMesh mesh = scrambled_grid(n);
      const QualityReport before = measure_quality(mesh);
      const auto start = std::chrono::steady_clock::now();
      const OptimizeResult result = optimize_mesh(mesh, nullptr, {.fixed_boundary = fixed});
      const std::chrono::duration<double, std::milli> time = std::chrono::steady_clock::now() - start;
      const QualityReport after = measure_quality(result.mesh);
      std::printf(
          "%s{\"hexes\": %zu, \"boundary\": \"%s\", \"inverted_before\": %zu, \"not_certified\": %zu, "
          "\"min_scaled_jacobian\": %.4f, \"ms_per_hex\": %.4f}",
          separator, mesh.num_cells(), fixed ? "fixed" : "sliding", before.inverted_cells, result.uncertified.size(),
          after.min_scaled_jacobian, time.count() / static_cast<double>(mesh.num_cells()));
      separator = ", ";
    }
  std::printf("]}\n");
}
