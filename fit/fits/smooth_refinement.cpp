// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/fits/smooth_refinement.h"

#include "subvol/fit/quality/quality.h"
#include "subvol/subdivision/limit_surface.h"
#include "subvol/subdivision/subdivision.h"

#include <utility>
#include <vector>

namespace subvol::internal {

VolumeMesh smooth_refinement(const VolumeMesh& mesh) {
  constexpr double kLeastJacobian = 0.2;  // scaled Jacobian; a vertex of a worse cell stays closer to the plain split
  // A vertex's share is halved in the first passes and is 0 from then on.
  constexpr int kSmoothRefinementHalvings = 6, kSmoothRefinementPasses = 10, kPointsPerDirection = 3;
  SubdivisionLevel level = subdivide(mesh);
  const std::vector<Vec3> split = linear_split(mesh).apply(mesh.positions);
  const std::vector<Vec3> smooth = limit_map(level.fine).apply(level.fine.positions);
  VolumeMesh fine = std::move(level.fine);
  std::vector<double> share(split.size(), 1);
  for (int pass = 0; pass < kSmoothRefinementPasses; ++pass) {
    for (std::size_t i = 0; i < split.size(); ++i) fine.positions[i] = (1 - share[i]) * split[i] + share[i] * smooth[i];
    const std::vector<double> least = measure_quality(fine, kPointsPerDirection).cell_minima;
    bool good = true;
    for (std::size_t c = 0; c < least.size(); ++c) {
      if (least[c] >= kLeastJacobian) continue;
      for (const Index v : fine.cell(c)) {
        good = good && share[v] == 0;
        share[v] *= pass < kSmoothRefinementHalvings ? 0.5 : 0;
      }
    }
    if (good) return fine;
  }
  fine.positions = split;
  return fine;
}

}  // namespace subvol::internal
