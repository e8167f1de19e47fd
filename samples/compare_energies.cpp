// SPDX-License-Identifier: GPL-3.0-or-later
// The comparison of the paper's figure 2: cells of order 3 around a singular line, where 3, 4 or 5 blocks of them meet,
// are left to themselves, with no surface to follow, under each distortion energy. A rigid one keeps the volume of
// every cell; a conformal one shrinks or swells cells by the singularity to keep their shapes.

#include "subvol/base/atomic_file.h"
#include "subvol/export/high_order_file.h"
#include "subvol/fit/energies/high_order_energy.h"
#include "subvol/fit/quality/high_order_quality.h"
#include "subvol/fit/solver/newton.h"

#include <Eigen/LU>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <map>
#include <memory>
#include <numbers>
#include <string>

namespace {

using namespace subvol;
using namespace subvol::internal;

constexpr int kStarBlockSide = 4, kStarLayers = 1, kStarOrder = 3;

/// Blocks of kStarBlockSide x kStarBlockSide x kStarLayers hexes around the z axis, skewed to share the full turn
/// between them.
VolumeMesh star(int blocks) {
  VolumeMesh mesh;
  std::map<std::array<int, 4>, Index> numbers;
  const auto ray = [&](int k) {
    const double angle = 2 * std::numbers::pi * k / blocks;
    return Vec3(std::cos(angle), std::sin(angle), 0);
  };
  // Vertices on a ray belong to the block that begins there, those on the axis to block 0.
  const auto vertex = [&](int block, int i, int j, int layer) {
    const Vec3 position = i * ray(block) + j * ray(block + 1) + Vec3(0, 0, layer);
    if (i == 0) block = (block + 1) % blocks, i = j, j = 0;
    if (i == 0) block = 0;
    const auto [entry, added] = numbers.try_emplace({block, i, j, layer}, static_cast<Index>(mesh.positions.size()));
    if (added) mesh.positions.push_back(position);
    return entry->second;
  };
  for (int block = 0; block < blocks; ++block)
    for (int j = 0; j < kStarBlockSide; ++j)
      for (int i = 0; i < kStarBlockSide; ++i)
        for (int k = 0; k < kStarLayers; ++k)
          mesh.add_cell(CellKind::hex,
                        std::array<Index, 8>{vertex(block, i, j, k), vertex(block, i + 1, j, k),
                                             vertex(block, i + 1, j + 1, k), vertex(block, i, j + 1, k),
                                             vertex(block, i, j, k + 1), vertex(block, i + 1, j, k + 1),
                                             vertex(block, i + 1, j + 1, k + 1), vertex(block, i, j + 1, k + 1)});
  return mesh;
}

/// Volume of a cell by the rule of its energy's kind: the mean of the determinants on a fine grid.
double volume(const HighOrderMesh& mesh, std::size_t cell) {
  constexpr int kVolumeGridPoints = 8;
  double sum = 0;
  for (int k = 0; k < kVolumeGridPoints; ++k)
    for (int j = 0; j < kVolumeGridPoints; ++j)
      for (int i = 0; i < kVolumeGridPoints; ++i)
        sum += mesh.jacobian(cell, (Vec3(i, j, k) + Vec3::Constant(0.5)) / kVolumeGridPoints).determinant();
  return sum / (kVolumeGridPoints * kVolumeGridPoints * kVolumeGridPoints);
}

HighOrderMesh relaxed(const VolumeMesh& start, Distortion distortion) {
  const ElementSpace space(start, Basis::fourier, kStarOrder);
  HighOrderMesh mesh(space, start);
  auto energy = std::make_unique<HighOrderEnergy>(mesh.space, std::vector(start.num_cells(), Vec3(1, 1, 1)),
                                                  std::vector<int>(start.num_cells(), 2 * kStarOrder + 1));
  energy->set_distortion(distortion);
  const SparseMap nodes = identity_map(mesh.coefficients.size());
  FitProblem problem(nodes, select_rows(nodes, {}), std::move(energy), nullptr, 1);
  minimize_newton(problem, mesh.coefficients, {.max_iterations = 200, .relative_decrease = 1e-6, .cg_tolerance = 0.01});
  return mesh;
}

}  // namespace

int main(int argc, char** argv) try {
  const std::filesystem::path folder = argc > 1 ? argv[1] : ".";
  bool valid = true;
  std::printf("blocks  energy              cells at the axis / on the rim, mean volume   scaled Jacobian mean, min\n");
  for (int blocks : {3, 4, 5}) {
    const VolumeMesh start = star(blocks);
    for (Distortion distortion : {Distortion::hencky, Distortion::inverse_mean_ratio, Distortion::condition_number}) {
      const HighOrderMesh mesh = relaxed(start, distortion);
      double inner = 0, outer = 0;  // cells are numbered by block, row, column, layer
      for (int block = 0; block < blocks; ++block)
        for (int k = 0; k < kStarLayers; ++k) {
          const std::size_t first = static_cast<std::size_t>(block) * kStarBlockSide * kStarBlockSide * kStarLayers;
          inner += volume(mesh, first + static_cast<std::size_t>(k));
          outer +=
              volume(mesh, first + static_cast<std::size_t>((kStarBlockSide * kStarBlockSide - 1) * kStarLayers + k));
        }
      const QualityReport quality = measure_quality(mesh);
      valid = valid && quality.inverted_cells == 0;
      std::printf("%-7d %-19s %-42.3f %.3f, %.3f\n", blocks, to_string(distortion), inner / outer,
                  quality.mean_scaled_jacobian, quality.min_scaled_jacobian);
      if (blocks != 4)
        write_file_atomically(folder / ("star" + std::to_string(blocks) + "_" + to_string(distortion) + ".vtu"),
                              vtu_text(mesh));
    }
  }
  return valid ? 0 : 1;
} catch (const std::exception& error) {
  std::fprintf(stderr, "compare_energies: %s\n", error.what());
  return 1;
}
