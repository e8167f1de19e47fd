// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/mesh/volume_mesh.h"

#include <span>
#include <vector>

namespace subvol {

/// Refines a mesh of hexes where its vertices are marked, and stays conforming: each edge between two marked vertices
/// is cut into three, each edge with one marked end at a third from it, and the other edges stay whole.
///
///        o-----------o     o-----------o     *---o---o---*
///        |           |     |\         /|     |   |   |   |       marked vertices: *
///        |           |     | o-------o |     o---o---o---o       A hex with one, two, four or eight of them becomes
///        |\_         |     | |       | |     |   |   |   |       4, 11, 22 or 27 hexes.
///        o--o        |     o-o-------o-o     o---o---o---o
///        |  |\______ |     | |       | |     |   |   |   |
///        *--o--------o     *-o-------o-*     *---o---o---*
///
/// Cells of which other vertices are marked get more marks, until every cell has one of these patterns: two diagonal
/// marks of a face become four, all else becomes eight. So around what was asked for, the marks end up convex.
///
/// marked  one entry per vertex, non-zero for marked ones.
/// returns old vertices with their numbers and places, then new ones at their places in the trilinear map of the cell;
///         a cell's parts follow one another, with its reference. Creases are cut with their edges, corners stay.
///
/// Nothing marked: the mesh as it is. InputError: a mesh that is not sound, or that gets a cell whose corners are not
/// positive; a mark on a cell that is no hex. Cost: linear but for the marks, which spread cell by cell.
/// Source: Schneiders, "A grid-based algorithm for the generation of hexahedral element meshes" (1996), where the four
/// patterns are from; that each can be made of strips swept from face to face is how they are built here.
VolumeMesh refine_at(const VolumeMesh& mesh, std::span<const char> marked);

/// All vertices of the cells chosen, as `refine_at` takes them: those cells are cut in 27. chosen: one entry per cell.
std::vector<char> vertices_of(const VolumeMesh& mesh, std::span<const char> chosen);

/// The hexes that are all there is between two opposite faces of the boundary, non-zero for those: where a mesh is one
/// cell thick.
std::vector<char> thin_cells(const VolumeMesh& mesh);

}  // namespace subvol
