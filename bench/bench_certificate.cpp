// SPDX-License-Identifier: GPL-3.0-or-later
// Microseconds per cell for the proof that linear hexes are nowhere inverted.
#include "bench/hex_grid.h"
#include "subvol/fit/certificate/certificate.h"

#include <omp.h>

#include <algorithm>
#include <chrono>
#include <cstdio>

using namespace subvol;

namespace {

/// Least time of several runs, microseconds per cell.
template <class Run>
double best_us_per_cell(std::size_t cells, int repeats, const Run& run) {
  double best = 1e300;
  for (int repeat = 0; repeat < repeats; ++repeat) {
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
    const VolumeMesh mesh = bench::hex_grid(50, amplitude);
    std::vector<std::uint8_t> positive(mesh.num_cells());
    for (int threads = 1; threads <= max_threads; threads *= 2) {
      omp_set_num_threads(threads);
      const double plain =
          best_us_per_cell(mesh.num_cells(), 15, [&] { positive_bernstein(mesh.positions, mesh, positive); });
      CertificateSummary summary;
      const double full = best_us_per_cell(mesh.num_cells(), 15, [&] { summary = certify(mesh); });
      std::printf(
          "%s\n  {\"cells\": %zu, \"amplitude\": %g, \"threads\": %d, \"coefficients_us_per_cell\": %.4f, "
          "\"certify_us_per_cell\": %.4f, \"coefficients_alone\": %zu, \"certified\": %zu, \"invalid\": %zu, "
          "\"undecided\": %zu}",
          separator, mesh.num_cells(), amplitude, threads, plain, full,
          static_cast<std::size_t>(std::count(positive.begin(), positive.end(), 1)), summary.certified, summary.invalid,
          summary.undecided);
      separator = ",";
    }
  }
  std::printf("\n]}\n");
}
