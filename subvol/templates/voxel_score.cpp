// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/templates/voxel_score.h"

#include "subvol/templates/voxel_steps.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace subvol::internal {

namespace {

/// Fractions of a cell from which on it must not be far from the solid, and from which on the solid may be near it.
constexpr double kInShape = 0.02, kMostlyInShape = 0.3;
/// Weight of the farthest cells, in steps, beside the relative volume of wrong cells.
constexpr double kExtremeWeight = 0.15;

}  // namespace

double voxel_score(const VoxelSolid& solid, std::span<const double> fractions, std::span<const double> volumes,
                   SearchStop* stop) {
  const auto anywhere = [](Index) { return true; };
  const std::vector<int> cover = voxel_steps(
      solid, [&](Index c) { return solid.filled(c); }, anywhere, nullptr, stop);
  const std::vector<int> stray = voxel_steps(
      solid, [&](Index c) { return fractions[c] > kMostlyInShape; }, anywhere, nullptr, stop);
  double volume = 0, wrong = 0, mean_cover = 0;
  int max_cover = 0, max_stray = 0;
  for (std::size_t c = 0; c < fractions.size(); ++c) {
    const bool filled = solid.filled(static_cast<Index>(c));
    const double weight = volumes.empty() ? 1 : volumes[c];
    volume += weight * fractions[c];
    wrong += weight * std::abs(fractions[c] - (filled ? 1 : 0));
    mean_cover += weight * (fractions[c] * cover[c]);
    if (fractions[c] > kInShape) max_cover = std::max(max_cover, cover[c]);
    if (filled) max_stray = std::max(max_stray, stray[c]);
  }
  return wrong / volume + mean_cover / volume + kExtremeWeight * (max_cover + std::max(0, max_stray - 1));
}

}  // namespace subvol::internal
