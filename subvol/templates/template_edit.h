// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/mesh/volume_mesh.h"

#include <span>
#include <string>

namespace subvol {

/// What the operations that edit templates share.

/// Throws InputError, starting with `name`, where `validate` finds anything but unused vertices.
void require_sound(const VolumeMesh& mesh, const std::string& name);

/// Whether det[n0-c, n1-c, n2-c] > 0 at every corner c of a cell.
bool corners_positive(const VolumeMesh& mesh, std::size_t cell);

/// Group number of a cell: 0 where the mesh has none.
inline int reference_of(const VolumeMesh& mesh, std::size_t cell) {
  return mesh.references.empty() ? 0 : mesh.references[cell];
}

/// The cells whose entry in `kept` is not zero, with references, on the vertices they use; both keep their order. Tags
/// stay where their edge or vertex is still on the boundary. kept: one entry per cell.
VolumeMesh kept_cells(const VolumeMesh& mesh, std::span<const char> kept);

/// Tags that name edges and vertices of the boundary of the mesh they are in; the others are dropped.
void drop_lost_tags(VolumeMesh& mesh);

/// Sorts tags as `FeatureTags` wants them, the larger sharpness of two equal entries counting; drops creases of one
/// vertex.
void normalise_tags(FeatureTags& tags);

}  // namespace subvol
