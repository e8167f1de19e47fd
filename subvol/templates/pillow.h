// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/mesh/validate.h"
#include "subvol/mesh/volume_mesh.h"

#include <array>
#include <functional>
#include <span>

namespace subvol {

/// Puts a layer of cells around a set of cells: the set shrinks, and each face of its boundary becomes a new cell
/// between its old and its new position (a hex for a quad, a prism for a triangle).
///
///        o---o---o            o---o---o
///        |   |   |            |\ /|\ /|        Faces of the set on the mesh's boundary get a cell as well: if the set
///        |   |   |    ->      | o-o-o |        holds all cells, the layer lies inside the whole boundary.
///        |   |   |            |/ \|/ \|
///        o---o---o            o---o---o
///
/// mesh    passes `validate` except for unused vertices, and inverted cells if these are allowed.
/// cells   numbers of the cells of the set, each once; empty: all cells.
/// inverted  allowed: cells around a vertex at which no step keeps all of them valid are left inverted, for
///           `optimize_mesh` to untangle. refused: that is an InputError.
/// returns the old cells, those of the set on new vertices, then one cell per face of the set's boundary, ordered by
/// cell and local face. Old vertices keep their numbers and positions; new vertices are appended. A new cell gets the
/// reference of its neighbor in the set. Tags and groups of faces stay on the set's boundary and outside it, and move
/// inward with the rest of the set: where a crease or a group inside the set ends at the layer, the edges or side faces
/// of the new cells continue it up to the old boundary.
///
/// A new vertex moves inward by 0.15 of the shortest edge that its old vertex has in the set, times the sum of the
/// distinct unit normals there; less if a cell would be inverted. In a mesh of cubes or boxes from a grid no cell can
/// be inverted if some direction sees all boundary faces around the vertex from their front (`VertexRule::pillowable`).
///
/// InputError: an invalid mesh; a cell number out of range or given twice; a set whose boundary is not a manifold (it
/// touches itself along an edge or at a vertex); a vertex at which no step keeps all cells valid, if inverted ones are
/// refused.
VolumeMesh pillow(const VolumeMesh& mesh, std::span<const Index> cells = {},
                  InvertedCells inverted = InvertedCells::refused);

/// Puts a layer of cells inside the boundary of each region: inside the mesh's boundary there, and on both sides of
/// each interface. Interfaces keep their vertices.
///
/// takes  asked for each connected part of a region's boundary, by the corners of its faces, four for each and
///        kNoIndex for those that a triangle lacks; returns false for parts that get no layer. Empty: all get one.
/// InputError: as `pillow`; regions whose boundaries are not manifolds.
using PillowChoice = std::function<bool(int reference, std::span<const std::array<Index, 4>> part)>;
VolumeMesh pillow_regions(const VolumeMesh& mesh, const PillowChoice& takes = {});

}  // namespace subvol
