// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/certificate.h"

#include <omp.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <random>

using namespace subvol;

namespace {

/// n^3 hexes, vertices moved by up to `amplitude` cell sizes.
VolumeMesh shaken_grid(int n, double amplitude) {
  VolumeMesh mesh;
  std::mt19937_64 engine(1);
  std::uniform_real_distribution<double> shift(-amplitude, amplitude);
  for (int k = 0; k <= n; ++k)
    for (int j = 0; j <= n; ++j)
      for (int i = 0; i <= n; ++i)
        mesh.positions.emplace_back(i + shift(engine), j + shift(engine), k + shift(engine));
  const auto id = [n](int i, int j, int k) { return static_cast<Index>(i + (n + 1) * (j + (n + 1) * k)); };
  for (int k = 0; k < n; ++k)
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i) {
        const Index v[8] = {id(i, j, k),         id(i + 1, j, k),         id(i + 1, j + 1, k),     id(i, j + 1, k),
                            id(i, j, k + 1), id(i + 1, j, k + 1), id(i + 1, j + 1, k + 1), id(i, j + 1, k + 1)};
        mesh.add_cell(CellKind::hex, v);
      }
  return mesh;
}

/// Least time of several runs, microseconds per cell.
template <class Run>
double best_us_per_cell(std::size_t cells, const Run& run) {
  double best = 1e300;
  for (int repeat = 0; repeat < 15; ++repeat) {
    const auto start = std::chrono::steady_clock::now();
    run();
    const std::chrono::duration<double, std::micro> time = std::chrono::steady_clock::now() - start;
    best = std::min(best, time.count() / static_cast<double>(cells));
  }
  return best;
}

}  // namespace

int main() {
  const int max_threads = omp_get_max_threads();
  std::printf("{\"bench\": \"certificate\", \"rows\": [");
  const char* separator = "";
  for (double amplitude : {0.0, 0.1, 0.2, 0.25, 0.3, 0.4}) {
    const VolumeMesh mesh = shaken_grid(50, amplitude);
    std::vector<std::uint8_t> positive(mesh.num_cells());
    for (int threads = 1; threads <= max_threads; threads *= 2) {
      omp_set_num_threads(threads);
      const double plain =
          best_us_per_cell(mesh.num_cells(), [&] { positive_bernstein(mesh.positions, mesh, positive); });
      CertificateSummary summary;
      const double full = best_us_per_cell(mesh.num_cells(), [&] { summary = certify(mesh); });
      std::printf("%s\n  {\"cells\": %zu, \"amplitude\": %g, \"threads\": %d, \"coefficients_us_per_cell\": %.4f, "
                  "\"certify_us_per_cell\": %.4f, \"coefficients_alone\": %zu, \"certified\": %zu, \"invalid\": %zu, "
                  "\"undecided\": %zu}",
                  separator, mesh.num_cells(), amplitude, threads, plain, full,
                  static_cast<std::size_t>(std::count(positive.begin(), positive.end(), 1)), summary.certified,
                  summary.invalid, summary.undecided);
      separator = ",";
    }
  }
  std::printf("\n]}\n");
}
