// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/subdivision/repeated_subdivision.h"

#include "subvol/base/error.h"

#include <cmath>
#include <limits>
#include <string>
#include <utility>

namespace subvol::internal {
namespace {

constexpr int kMostLevels = 8;  // 16 million cells from one

// Vertices, edges and faces are numbered with 32 bits, and a hex mesh has about three times as many faces as cells.
void require_numberable(const VolumeMesh& mesh, int levels) {
  const double most = static_cast<double>(std::numeric_limits<Index>::max()) / 3.5;
  const double cells = static_cast<double>(mesh.num_cells()) * std::pow(8.0, levels);
  if (cells > most)
    throw InputError("levels " + std::to_string(levels) + " would make up to " + std::to_string(cells) +
                     " cells; at most " + std::to_string(most) + " can be numbered");
}

/// Refines several times with step(mesh), which refines once.
template <class Step>
VolumeMesh repeated(const VolumeMesh& control, int levels, SparseMap* matrix, const Step& step) {
  if (levels < 0 || levels > kMostLevels)
    throw InputError("levels must be in [0, " + std::to_string(kMostLevels) + "], got " + std::to_string(levels));
  require_numberable(control, levels);
  VolumeMesh fine = control;
  if (matrix) *matrix = identity_map(control.num_vertices());
  for (int level = 0; level < levels; ++level) {
    SubdivisionLevel refined = step(fine);
    if (matrix) *matrix = compose(refined.matrix, *matrix);
    fine = std::move(refined.fine);
  }
  return fine;
}

}  // namespace

VolumeMesh subdivide_repeatedly(const VolumeMesh& control, int levels, BoundaryRule rule, SparseMap* matrix) {
  return repeated(control, levels, matrix, [&](const VolumeMesh& mesh) { return subdivide(mesh, rule); });
}

VolumeMesh split_repeatedly(const VolumeMesh& control, int levels, SparseMap* matrix) {
  return repeated(control, levels, matrix, [](const VolumeMesh& mesh) {
    SubdivisionLevel refined = subdivide(mesh);
    refined.matrix = linear_split(mesh);
    refined.fine.positions = refined.matrix.apply(mesh.positions);
    return refined;
  });
}

}  // namespace subvol::internal
