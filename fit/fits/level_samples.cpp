// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/fits/level_samples.h"

#include "subvol/fit/elements/basis.h"
#include "subvol/fit/elements/boundary_samples.h"
#include "subvol/fit/elements/element_space.h"

#include <utility>

namespace subvol::internal {

LevelSamples samples_of(const VolumeMesh& mesh) {
  constexpr int kIntervals = 2;  // along an edge: corners, middles of edges and of faces
  BoundarySamples samples =
      make_boundary_samples(ElementSpace(mesh, Basis::legendre, 1), kIntervals, mesh.tags.creases);
  return {std::move(samples.positions), std::move(samples.triangles), std::move(samples.triangle_faces),
          std::move(samples.crease_edges)};
}

LevelSamples samples_of(const FittedCage& cage) {
  const FitLevel& level = cage.level();
  return {level.samples, level.sample_triangles, level.sample_faces, level.crease_edges};
}

}  // namespace subvol::internal
