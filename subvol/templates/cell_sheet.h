// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/mesh/mesh_topology.h"
#include "subvol/mesh/volume_mesh.h"

#include <array>
#include <vector>

namespace subvol {

/// Returns the edges of a sheet of cells: the edge v0-v1, the edges opposite to it across quads, the edges opposite to
/// those, and so on. All are directed alike, from the side of the sheet that holds v0 to the side that holds v1.
///
///        o---o---o        Starting from edge a-b, the sheet holds
///        |   |   |        all the edges drawn upright.
///        a---o---o
///        |   |   |
///        b---o---o
///
/// returns  pairs of vertices, in order of discovery; the first one is (v0, v1).
/// InputError: there is no edge between v0 and v1; the sheet returns to an edge in the opposite direction.
std::vector<std::array<Index, 2>> sheet_edges(const MeshTopology& topology, Index v0, Index v1);

/// Cuts all edges of a sheet of cells into equal parts, and its cells with them: a hex into hexes, and a prism into
/// prisms between its triangles. Old vertices keep their numbers and positions; creases along the cut edges are cut as
/// well.
///
/// parts  >= 2. The parts of a cell follow one another, with its reference.
/// InputError: as `sheet_edges`; a sheet that crosses itself in a cell, or runs into a triangle; parts < 2; an invalid
/// mesh.
VolumeMesh split_sheet(const VolumeMesh& mesh, Index v0, Index v1, int parts = 2);

/// Removes the cells of a sheet: every edge shrinks to its end on the side of v0, or to its other end if the boundary
/// or an interface between regions holds only that one, or both hold it. `collapse_sheet(m, a, n)` undoes a
/// `split_sheet(m, a, b)` that put n between a and b.
/// InputError: as `sheet_edges`; an invalid mesh; a result that `merge_vertices` refuses, or without a region.
VolumeMesh collapse_sheet(const VolumeMesh& mesh, Index v0, Index v1);

/// Shrinks one edge to its midpoint, or to one end as `collapse_sheet`. The tets around the edge disappear; in a mesh
/// of hexes, only a whole sheet can be collapsed. InputError: no such edge; an invalid mesh; a result as for
/// `collapse_sheet`.
VolumeMesh collapse_edge(const VolumeMesh& mesh, Index v0, Index v1);

/// Folds a quad shut by joining its opposite corners v0 and v2 halfway, or at one of them as `collapse_sheet`, and with
/// it all quads opposite to it through hexes: a whole column of hexes disappears. InputError: no such face; an invalid
/// mesh; a column that meets cells other than hexes, or crosses itself; a result as for `collapse_sheet`.
VolumeMesh collapse_face(const VolumeMesh& mesh, Index v0, Index v2);

}  // namespace subvol
