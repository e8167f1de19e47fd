// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/mesh/volume_mesh.h"

#include <span>
#include <vector>

namespace subvol {

/// Refines a mesh of hexes near its marked vertices and keeps it conforming: an edge between two marked vertices is cut
/// into three, an edge with one marked end is cut at a third from that end, and all other edges stay whole.
///
///        o-----------o     o-----------o     *---o---o---*
///        |           |     |\         /|     |   |   |   |       marked vertices: *
///        |           |     | o-------o |     o---o---o---o       A hex with one, two, four or eight of them becomes
///        |\_         |     | |       | |     |   |   |   |       4, 11, 22 or 27 hexes.
///        o--o        |     o-o-------o-o     o---o---o---o
///        |  |\______ |     | |       | |     |   |   |   |
///        *--o--------o     *-o-------o-*     *---o---o---*
///
/// Cells with any other set of marked vertices get more marks, until every cell has one of these patterns: two marks on
/// a diagonal of a face, or three on a face, become four; all others become eight. So the marks end up convex around
/// the region that was asked for.
///
/// marked  one entry per vertex, non-zero for marked ones.
/// returns the old vertices with their numbers and positions, then the new ones, placed by the trilinear map of their
/// cell; the parts of a cell follow one another, with its reference. Creases are cut with their edges; corners stay.
///
/// If nothing is marked, the mesh is returned unchanged. InputError: an invalid mesh; a part that would have a corner
/// Jacobian <= 0; a mark on a cell that is not a hex. Cost: linear, except for the marks, which spread cell by cell.
/// Source: the four patterns are those of Schneiders, "A grid-based algorithm for the generation of hexahedral element
/// meshes" (1996); they are built here from strips swept from face to face.
VolumeMesh refine_at(const VolumeMesh& mesh, std::span<const char> marked);

/// Says whether a part of a warped cell that has a corner Jacobian <= 0 is an error.
enum class WarpedParts { refused, kept };

/// A refined mesh, and where its cells come from.
struct LocalRefinement {
  VolumeMesh mesh;
  std::vector<Index> parents;  ///< for each cell, the cell that it is a part of, or was
};

/// Does the same as `refine_at`, and returns the parents of the cells. The mesh may touch itself at edges and vertices.
///
/// warped  kept: a part that is inverted is no error.
/// InputError: as `refine_at`.
LocalRefinement refine_locally(const VolumeMesh& mesh, std::span<const char> marked, WarpedParts warped);

/// Marks all vertices of the chosen cells, as `refine_at` expects them: those cells are cut into 27. chosen: one entry
/// per cell.
std::vector<char> vertices_of(const VolumeMesh& mesh, std::span<const char> chosen);

/// Marks the hexes with two opposite faces on the boundary (non-zero): the places at which the mesh is one cell thick.
std::vector<char> thin_cells(const VolumeMesh& mesh);

}  // namespace subvol
