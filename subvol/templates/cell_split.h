// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/mesh/volume_mesh.h"

namespace subvol {

/// Cuts every hex and prism into tets without new vertices: a prism into 3, a hex into 5 or 6. Each quad is cut by the
/// diagonal at its smallest vertex number, so that neighbours agree.
/// Source: Dompierre, Labbe, Vallet, Camarero, "How to subdivide pyramids, prisms and hexahedra into tetrahedra"
/// (1999). returns  parts of a cell one after another, with its reference; tags as they are. InputError: a mesh that is
/// not sound, or a tet that would be inverted: cells whose quads are strongly warped.
VolumeMesh split_into_tets(const VolumeMesh& mesh);

/// Cuts every hex into two prisms whose triangles lie across the direction of an edge; that direction is carried from
/// hex to hex through the mesh. The quads of a column of hexes are all cut alike, from the smallest vertex of its first
/// one. InputError: other cells than hexes; no such edge; a mesh in which the direction cannot be carried around; a
/// mesh that is not sound.
VolumeMesh split_into_prisms(const VolumeMesh& mesh, Index v0, Index v1);

}  // namespace subvol
