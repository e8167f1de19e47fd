// SPDX-License-Identifier: GPL-3.0-or-later
// Curved cells, one thread: nanoseconds per quadrature point for the energy, its gradient (and how much faster two
// threads are) and products with its Hessian, and microseconds per cell for the proof that none is inverted, beside
// those of an energy and gradient: of the first pass, which makes the models that it needs (less those of the row's
// amplitudes before), and of later ones. Times for the proof and what stands beside it are those of the processor.
#include "bench/freed_memory.h"
#include "bench/hex_grid.h"
#include "subvol/fit/certificate/high_order_certificate.h"
#include "subvol/fit/energies/high_order_energy.h"

#include <omp.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <random>

using namespace subvol;
using namespace subvol::internal;

namespace {

/// Least time of several runs, microseconds.
template <class Run>
double best_microseconds(int repeats, const Run& run) {
  double best = 1e300;
  for (int repeat = 0; repeat < repeats; ++repeat) {
    const auto start = std::chrono::steady_clock::now();
    run();
    const std::chrono::duration<double, std::micro> time = std::chrono::steady_clock::now() - start;
    best = std::min(best, time.count());
  }
  return best;
}

/// The same of the processor's time.
template <class Run>
double best_cpu_microseconds(int repeats, const Run& run) {
  double best = 1e300;
  for (int repeat = 0; repeat < repeats; ++repeat) {
    const std::clock_t start = std::clock();
    run();
    best = std::min(best, 1e6 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
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

void print_energy(const ElementSpace& space, const std::vector<Vec3>& nodes, int order, const char* separator,
                  double& gradient_us_per_cell) {
  const std::vector<Vec3> lengths(space.num_cells(), Vec3::Ones());
  const std::vector<int> points(space.num_cells(), std::max(5, 2 * order - 1));  // as many as the fit takes
  HighOrderEnergy energy(space, lengths, points);
  std::vector<Vec3> gradient(nodes.size()), product(nodes.size());
  const double num_points = static_cast<double>(energy.num_points());
  const double value = best_microseconds(5, [&] { energy.value(nodes); });
  const double both = best_microseconds(5, [&] { energy.add_gradient(nodes, 1, gradient); });
  omp_set_num_threads(2);
  const double both_by_two = best_microseconds(5, [&] { energy.add_gradient(nodes, 1, gradient); });
  omp_set_num_threads(1);
  const double second = best_microseconds(3, [&] { energy.linearize(nodes, 1, gradient); });
  const double multiply = best_microseconds(5, [&] { energy.multiply(gradient, product); });
  const double both_cpu = best_cpu_microseconds(5, [&] { energy.add_gradient(nodes, 1, gradient); });
  gradient_us_per_cell = both_cpu / static_cast<double>(space.num_cells());
  std::printf(
      "%s\n  {\"kind\": \"%s\", \"basis\": \"%s\", \"order\": %d, \"points_per_cell\": %.0f, "
      "\"value_ns_per_point\": %.1f, \"gradient_ns_per_point\": %.1f, \"second_derivative_ns_per_point\": "
      "%.1f, \"product_ns_per_point\": %.1f, \"gradient_us_per_cell\": %.1f, "
      "\"gradient_gain_of_two_threads\": %.2f",
      separator, cell_topology(space.kind(0)).name, to_string(space.basis()), order,
      num_points / static_cast<double>(space.num_cells()), 1e3 * value / num_points, 1e3 * both / num_points,
      1e3 * second / num_points, 1e3 * multiply / num_points, gradient_us_per_cell, both / both_by_two);
}

/// Shares of a cell's edge by which modes are random.
constexpr double kAmplitudes[] = {0.05, 0.1, 0.2};
/// Passes that take so many microseconds are not repeated.
constexpr double kLongestRepeatedPassMicroseconds = 2e6;

void print_certificate(const ElementSpace& space, const VolumeMesh& mesh, double gradient_us_per_cell) {
  const double cells = static_cast<double>(mesh.num_cells());
  for (const double amplitude : kAmplitudes) {
    const std::vector<Vec3> nodes = random_modes(space, mesh, amplitude);
    CertificateSummary summary;
    const double first = best_cpu_microseconds(1, [&] { certify(space, nodes); }) / cells;
    const double time = best_cpu_microseconds(first * cells > kLongestRepeatedPassMicroseconds ? 1 : 5,
                                              [&] { summary = certify(space, nodes); }) /
                        cells;
    std::printf(
        ", \"certify_%g_us_per_cell\": %.2f, \"certify_%g_to_gradient\": %.2f, "
        "\"first_%g_us_per_cell\": %.2f, \"first_%g_to_gradient\": %.2f, \"valid_%g\": %zu, "
        "\"invalid_%g\": %zu, \"undecided_%g\": %zu",
        amplitude, time, amplitude, time / gradient_us_per_cell, amplitude, first, amplitude,
        first / gradient_us_per_cell, amplitude, summary.certified, amplitude, summary.invalid, amplitude,
        summary.undecided);
  }
}

}  // namespace

int main() {
  omp_set_num_threads(1);
  keep_freed_memory();
  std::printf("{\"bench\": \"high_order\", \"threads\": 1, \"rows\": [");
  const char* separator = "";
  for (const CellKind kind : {CellKind::hex, CellKind::prism, CellKind::tet})
    for (const Basis basis : {Basis::fourier, Basis::legendre})
      for (const int order : {1, 2, 4, 8, 12}) {
        const VolumeMesh mesh = bench::cells_of(kind, order > 8 ? 2 : order > 4 ? 3 : 6, 0.1);
        const ElementSpace space(mesh, basis, order);
        double gradient_us_per_cell = 0;
        print_energy(space, random_modes(space, mesh, 0.02), order, separator, gradient_us_per_cell);
        print_certificate(space, mesh, gradient_us_per_cell);
        std::printf("}");
        std::fflush(stdout);
        separator = ",";
      }
  std::printf("\n]}\n");
}
