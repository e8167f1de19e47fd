// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/quality/corner_quality.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

namespace subvol {
namespace {

/// A corner and its three neighbors, in the order of a right-handed system.
using Corner = std::array<int, 4>;

constexpr std::array<Corner, 8> kHexCorners{
    {{0, 1, 3, 4}, {1, 2, 0, 5}, {2, 3, 1, 6}, {3, 0, 2, 7}, {4, 7, 5, 0}, {5, 4, 6, 1}, {6, 5, 7, 2}, {7, 6, 4, 3}}};
constexpr std::array<Corner, 6> kPrismCorners{
    {{0, 1, 2, 3}, {1, 2, 0, 4}, {2, 0, 1, 5}, {3, 5, 4, 0}, {4, 3, 5, 1}, {5, 4, 3, 2}}};
constexpr std::array<Corner, 4> kTetCorners{{{0, 1, 2, 3}, {1, 2, 0, 3}, {2, 0, 1, 3}, {3, 1, 0, 2}}};

constexpr std::array<Corner, 4> kPyramidCorners{{{0, 1, 3, 4}, {1, 2, 0, 4}, {2, 3, 1, 4}, {3, 0, 2, 4}}};

std::span<const Corner> corners_of(CellKind kind) {
  switch (kind) {
    case CellKind::hex: return kHexCorners;
    case CellKind::pyramid: return kPyramidCorners;
    case CellKind::prism: return kPrismCorners;
    default: return kTetCorners;
  }
}

double factor_of(CellKind kind) {
  switch (kind) {
    case CellKind::hex: return 1;
    case CellKind::prism: return 2 / std::sqrt(3.0);
    default: return std::sqrt(2.0);
  }
}

}  // namespace

CornerQuality measure_corner_quality(const VolumeMesh& mesh) {
  CornerQuality quality;
  quality.cell_minima.resize(mesh.num_cells());
#pragma omp parallel for schedule(static)
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    const auto cell = mesh.cell(c);
    double least = 1;
    for (const auto& [corner, i, j, k] : corners_of(mesh.kinds[c])) {
      const Vec3& x = mesh.positions[cell[corner]];
      const Vec3 u = (mesh.positions[cell[i]] - x).stableNormalized(),
                 v = (mesh.positions[cell[j]] - x).stableNormalized(),
                 w = (mesh.positions[cell[k]] - x).stableNormalized();
      const double here = factor_of(mesh.kinds[c]) * u.cross(v).dot(w);
      if (!(here >= least)) least = std::isfinite(here) ? here : -1;
    }
    quality.cell_minima[c] = std::max(-1.0, least);
  }
  if (quality.cell_minima.empty()) return quality;
  double sum = 0;
  for (const double value : quality.cell_minima) sum += value;
  quality.mean_scaled_jacobian = sum / static_cast<double>(mesh.num_cells());
  quality.min_scaled_jacobian = *std::min_element(quality.cell_minima.begin(), quality.cell_minima.end());
  return quality;
}

}  // namespace subvol
