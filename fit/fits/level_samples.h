// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/fits/fitted_cage.h"
#include "subvol/mesh/volume_mesh.h"
#include "subvol/subdivision/sparse_map.h"

#include <array>
#include <vector>

namespace subvol::internal {

/// The samples of a surface at which it is compared with the target.
struct LevelSamples {
  SparseMap positions;  ///< degrees of freedom -> samples
  std::vector<std::array<Index, 3>> triangles;
  std::vector<Index> faces;  ///< face of the mesh of each triangle, by `MeshTopology`
  /// Edges between samples along the creases of the mesh, in the order of its tags, with the same number for each.
  std::vector<std::array<Index, 2>> crease_edges;
};

/// Returns the samples of the flat-sided boundary of a mesh, four quads for each of its faces. The degrees of freedom
/// are its vertices.
LevelSamples samples_of(const VolumeMesh& mesh);

/// Returns those of its boundary and its interfaces, in the same way.
LevelSamples samples_of_sheets(const VolumeMesh& mesh);

/// Returns the samples of the surface of a cage's mesh, and of its interfaces (`FitLevel`). The degrees of freedom are
/// the cage's vertices.
LevelSamples samples_of(const FittedCage& cage);

}  // namespace subvol::internal
