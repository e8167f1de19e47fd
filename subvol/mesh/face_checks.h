// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/mesh/mesh_defects.h"
#include "subvol/mesh/mesh_topology.h"

namespace subvol::internal {

// These checks of how the cells of a mesh meet add what they find to `defects`.

/// Checks that no face belongs to more than two cells. Returns false if one does. Needs no topology, but vertex numbers
/// in range.
bool check_shared_faces(const VolumeMesh& mesh, DefectList& defects);

// The others expect that no face belongs to more than two cells. topology: of this mesh.

/// Checks that no boundary quad stands against triangles, and that no vertex hangs in a boundary edge of a cell without
/// it. Cost: sorts of the triangles.
void check_conformity(const VolumeMesh& mesh, const MeshTopology& topology, DefectList& defects);

/// Checks that each boundary edge has two boundary faces, and that the boundary faces at each vertex form one fan.
void check_boundary_is_manifold(const MeshTopology& topology, DefectList& defects);

/// Checks that two cells see their common face from opposite sides, with the corners in the same order around it.
void check_orientation(const VolumeMesh& mesh, const MeshTopology& topology, DefectList& defects);

}  // namespace subvol::internal
