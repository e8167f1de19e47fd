// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/mesh/mesh_defects.h"
#include "subvol/mesh/mesh_topology.h"

namespace subvol::internal {

// These checks of a mesh's tags add what they find to `defects`.

/// Checks that creases and corners are on the boundary or on an interface, as far as their vertices are there.
/// topology: of this mesh.
void check_tag_places(const VolumeMesh& mesh, const MeshTopology& topology, DefectList& defects);

/// Checks that the tags name vertices of the mesh, are sorted, none is there twice, and that sharpness is > 0.
void check_tag_values(const VolumeMesh& mesh, DefectList& defects);

}  // namespace subvol::internal
