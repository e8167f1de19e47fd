// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/mesh/volume_mesh.h"

namespace subvol {

/// Cuts every hex into 6 tets, every prism into 3 and every pyramid into 2, without new vertices. Each quad is cut
/// along the diagonal at its smallest vertex number, so that neighbors agree.
/// Source: Dompierre, Labbe, Vallet, Camarero, "How to subdivide pyramids, prisms and hexahedra into tetrahedra"
/// (1999).
///
/// returns  the parts of each cell, one after another, with the cell's reference; the tags are unchanged.
/// InputError: an invalid mesh; a tet that would be inverted, which happens in cells with strongly warped quads.
VolumeMesh split_into_tets(const VolumeMesh& mesh);

/// Cuts every hex into two prisms whose axis is the direction of an edge; that direction is carried from hex to hex
/// through the mesh. The triangles cut the quads across this direction; all such quads of a column of hexes are cut
/// alike, at the smallest vertex of the column's first one.
/// InputError: cells other than hexes; no edge between v0 and v1; a mesh in which the direction cannot be carried
/// around consistently, or does not reach every cell; an invalid mesh.
VolumeMesh split_into_prisms(const VolumeMesh& mesh, Index v0, Index v1);

}  // namespace subvol
