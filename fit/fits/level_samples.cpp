// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/fits/level_samples.h"

#include "subvol/fit/elements/basis.h"
#include "subvol/fit/elements/boundary_samples.h"
#include "subvol/fit/elements/element_space.h"

#include <utility>

namespace subvol::internal {

namespace {

constexpr int kSampledIntervals = 2;  // along an edge: corners, middles of edges and of faces

LevelSamples taken(BoundarySamples samples) {
  return {std::move(samples.positions), std::move(samples.triangles), std::move(samples.triangle_faces),
          std::move(samples.crease_edges)};
}

}  // namespace

LevelSamples samples_of(const VolumeMesh& mesh) {
  return taken(make_boundary_samples(ElementSpace(mesh, Basis::legendre, 1), kSampledIntervals, mesh.tags.creases));
}

LevelSamples samples_of_sheets(const VolumeMesh& mesh) {
  return taken(make_sheet_samples(ElementSpace(mesh, Basis::legendre, 1), mesh, kSampledIntervals, mesh.tags.creases));
}

LevelSamples samples_of(const FittedCage& cage) {
  const FitLevel& level = cage.level();
  return {level.samples, level.sample_triangles, level.sample_faces, level.crease_edges};
}

}  // namespace subvol::internal
