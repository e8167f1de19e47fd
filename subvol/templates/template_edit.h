// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/mesh/volume_mesh.h"

#include <span>
#include <string>

namespace subvol::internal {

// Helpers of the operations that edit templates.

/// Returns true if det[n0-c, n1-c, n2-c] > 0 at every corner c of a cell, with neighbors n0, n1, n2. The apex of a
/// pyramid does not count.
bool corners_positive(const VolumeMesh& mesh, std::size_t cell);

/// Returns the reference of a cell; 0 if the mesh has no references.
inline int reference_of(const VolumeMesh& mesh, std::size_t cell) {
  return mesh.references.empty() ? 0 : mesh.references[cell];
}

/// Returns the cells whose entry in `kept` is not zero, with their references and the vertices they use; cells and
/// vertices keep their order. Tags stay if their edge or vertex is still on the boundary. kept: one entry per cell.
VolumeMesh kept_cells(const VolumeMesh& mesh, std::span<const char> kept);

/// Drops the tags whose edge or vertex is not on the mesh's boundary.
void drop_lost_tags(VolumeMesh& mesh);

/// Sorts tags as `FeatureTags` requires; of equal entries the one with the larger sharpness remains. Drops creases
/// whose ends are the same vertex.
void normalize_tags(FeatureTags& tags);

}  // namespace subvol::internal
