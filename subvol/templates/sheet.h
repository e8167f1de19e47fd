// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/mesh/mesh_topology.h"
#include "subvol/mesh/volume_mesh.h"

#include <array>
#include <vector>

namespace subvol {

/// The edges that face an edge across quads, and those that face these, and so on; all directed alike, from the first
/// end's side of the sheet to the second's.
///
///        o---o---o        starting from edge a-b, the sheet holds
///        |   |   |        all the edges drawn upright
///        a---o---o
///        |   |   |
///        b---o---o
///
/// returns  pairs of vertices, in order of discovery, the first one (v0, v1).
/// InputError: there is no edge between v0 and v1; the sheet comes back to an edge the other way round.
std::vector<std::array<Index, 2>> sheet_edges(const MeshTopology& topology, Index v0, Index v1);

/// Cuts all edges of a sheet into equal parts, and with them the cells: a hex into hexes, a prism between its triangles
/// into prisms. Old vertices keep their numbers and places; creases along the edges are cut as well.
///
/// parts  >= 2. A cell's parts follow one another, with its reference.
/// InputError: as `sheet_edges`; a sheet that crosses itself in a cell, or runs into a triangle; parts < 2; a mesh that
/// is not sound.
VolumeMesh split_sheet(const VolumeMesh& mesh, Index v0, Index v1, int parts = 2);

/// Takes the cells of a sheet out: every edge shrinks to its end on the side of v0, or to the other one where only that
/// is on the boundary. `collapse_sheet(m, a, n)` undoes a `split_sheet(m, a, b)` that put n between a and b.
/// InputError: as `sheet_edges`; what `merge_vertices` refuses.
VolumeMesh collapse_sheet(const VolumeMesh& mesh, Index v0, Index v1);

/// Shrinks one edge to its midpoint, or to its end on the boundary where only one end is there. Tets around the edge
/// go; a mesh of hexes allows that for a sheet only. InputError: no such edge; what `merge_vertices` refuses.
VolumeMesh collapse_edge(const VolumeMesh& mesh, Index v0, Index v1);

/// Folds a quad shut, joining its opposite corners v0 and v2 half-way (or on the boundary where only one is there),
/// with all quads that face it through hexes: a whole column of hexes goes. InputError: no such face; a column that
/// meets other cells than hexes, or crosses itself; what `merge_vertices` refuses.
VolumeMesh collapse_face(const VolumeMesh& mesh, Index v0, Index v2);

}  // namespace subvol
