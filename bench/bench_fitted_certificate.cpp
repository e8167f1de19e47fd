// SPDX-License-Identifier: GPL-3.0-or-later
// Usage: bench_fitted_certificate FILE.vtu ...  (curved meshes that `subvol fit --order P` has written)
// Microseconds per cell, one thread, of an energy and gradient with the points of a fit, and by that the proof that no
// cell is inverted: of the first pass, which makes the models that it needs, and of later ones.
#include "bench/freed_memory.h"
#include "subvol/base/error.h"
#include "subvol/export/high_order_file.h"
#include "subvol/fit/certificate/high_order_certificate.h"
#include "subvol/fit/energies/high_order_energy.h"

#include <omp.h>

#include <algorithm>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <vector>

using namespace subvol;
using namespace subvol::internal;

namespace {

constexpr int kLeastTimedPasses = 5, kLeastPoints = 5;
constexpr double kLeastMicroseconds = 3e5;  // of all passes over a mesh: few cells take more of them

template <class Work>
double processor_microseconds(const Work& work) {
  const std::clock_t start = std::clock();
  work();
  return 1e6 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

void measure(const char* path, bool last) {
  const HighOrderMesh mesh = read_high_order(path).mesh;
  const std::size_t num_cells = mesh.space.num_cells();
  HighOrderCertifier certifier(mesh.space);
  double first = 0, later = 1e300, total = 0;
  std::size_t boxes = 0, not_valid = 0;
  for (int pass = 0; pass < kLeastTimedPasses || total < kLeastMicroseconds; ++pass) {
    boxes = not_valid = 0;
    const double time = processor_microseconds([&] {
      for (std::size_t c = 0; c < num_cells; ++c) {
        const CellCertificate certificate = certifier.certify(mesh.coefficients, c);
        boxes += static_cast<std::size_t>(certificate.boxes);
        not_valid += certificate.validity != CellValidity::valid;
      }
    });
    total += time;
    if (pass == 0)
      first = time;
    else
      later = std::min(later, time);
  }
  std::vector<int> points(num_cells);
  for (std::size_t c = 0; c < num_cells; ++c)
    points[c] = std::max(kLeastPoints, points_for_order(mesh.space.pattern_order(mesh.space.pattern(c))));
  const HighOrderEnergy energy(mesh.space, std::vector(num_cells, Vec3(1, 1, 1)), points);
  std::vector<Vec3> gradient(mesh.coefficients.size(), Vec3::Zero());
  double gradient_time = 1e300;
  total = 0;
  for (int pass = 0; pass < kLeastTimedPasses || total < kLeastMicroseconds; ++pass) {
    const double time = processor_microseconds([&] { energy.add_gradient(mesh.coefficients, 1, gradient); });
    total += time;
    gradient_time = std::min(gradient_time, time);
  }
  const double cells = static_cast<double>(num_cells);
  std::printf(
      " {\"mesh\": \"%s\", \"cells\": %zu, \"order\": %d, \"energy_and_gradient_us\": %.2f, "
      "\"proof_first\": %.2f, \"proof_later\": %.2f, \"boxes_per_cell\": %.1f, \"not_valid\": %zu}%s\n",
      std::filesystem::path(path).stem().string().c_str(), num_cells, mesh.space.max_order(), gradient_time / cells,
      first / gradient_time, later / gradient_time, static_cast<double>(boxes) / cells, not_valid, last ? "" : ",");
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: bench_fitted_certificate FILE.vtu ...\n");
    return 2;
  }
  omp_set_num_threads(1);
  keep_freed_memory();
  try {
    std::printf("{\"bench\": \"fitted_certificate\", \"rows\": [\n");
    for (int i = 1; i < argc; ++i) measure(argv[i], i + 1 == argc);
    std::printf("]}\n");
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
