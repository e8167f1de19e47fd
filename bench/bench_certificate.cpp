// SPDX-License-Identifier: GPL-3.0-or-later
#include "bench/hex_grid.h"
#include "fit/certificate.h"
#include "fit/high_order_certificate.h"

#include <omp.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <random>

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

/// Modes are random, falling with the square of their order; amplitude in mean edges.
std::vector<Vec3> random_modes(const ElementSpace& space, const VolumeMesh& mesh, double amplitude) {
  std::vector<Vec3> coefficients(space.num_nodes(), Vec3::Zero());
  std::copy(mesh.positions.begin(), mesh.positions.end(), coefficients.begin());
  std::mt19937_64 engine(1);
  std::normal_distribution<double> normal;
  for (std::size_t c = 0; c < space.num_cells(); ++c)
    for (std::size_t a = 0; a < space.nodes(c).size(); ++a) {
      const LocalMode& m = space.modes(c)[a];
      const double size = amplitude / (m.i * m.i + m.j * m.j + m.k * m.k + 1e-300);
      Vec3& x = coefficients[space.nodes(c)[a]];
      if (static_cast<std::size_t>(space.nodes(c)[a]) >= space.num_vertices())
        for (int d = 0; d < 3; ++d) x[d] = size * normal(engine);
    }
  return coefficients;
}

/// One thread: times per cell for all kinds.
void time_high_order(const char* separator) {
  omp_set_num_threads(1);
  for (const CellKind kind : {CellKind::hex, CellKind::prism, CellKind::tet})
    for (const Basis basis : {Basis::fourier, Basis::legendre})
      for (const int order : {1, 2, 4, 8, 12})
        for (const double amplitude : {0.0, 0.05, 0.1, 0.2}) {
          if (kind != CellKind::hex && order > 8) continue;
          const VolumeMesh mesh = bench::cells_of(kind, order > 4 ? 3 : 6, 0.1);
          const ElementSpace space(mesh, basis, order);
          const std::vector<Vec3> coefficients = random_modes(space, mesh, amplitude);
          CertificateSummary summary;
          const double time =
              best_us_per_cell(mesh.num_cells(), 3, [&] { summary = certify(space, coefficients); });
          HighOrderCertifier certifier(space);
          std::size_t boxes = 0;
          for (std::size_t c = 0; c < mesh.num_cells(); ++c) boxes += certifier.certify(coefficients, c).boxes;
          std::printf("%s\n  {\"kind\": \"%s\", \"basis\": \"%s\", \"order\": %d, \"amplitude\": %g, "
                      "\"us_per_cell\": %.2f, \"boxes_per_cell\": %.2f, \"cells\": %zu, \"certified\": %zu, "
                      "\"invalid\": %zu, \"undecided\": %zu}",
                      separator, cell_topology(kind).name, to_string(basis), order, amplitude, time,
                      static_cast<double>(boxes) / static_cast<double>(mesh.num_cells()), mesh.num_cells(),
                      summary.certified, summary.invalid, summary.undecided);
          separator = ",";
        }
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
      std::printf("%s\n  {\"cells\": %zu, \"amplitude\": %g, \"threads\": %d, \"coefficients_us_per_cell\": %.4f, "
                  "\"certify_us_per_cell\": %.4f, \"coefficients_alone\": %zu, \"certified\": %zu, \"invalid\": %zu, "
                  "\"undecided\": %zu}",
                  separator, mesh.num_cells(), amplitude, threads, plain, full,
                  static_cast<std::size_t>(std::count(positive.begin(), positive.end(), 1)), summary.certified,
                  summary.invalid, summary.undecided);
      separator = ",";
    }
  }
  time_high_order(separator);
  std::printf("\n]}\n");
}
