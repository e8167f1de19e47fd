// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/mesh/volume_mesh.h"

#include <span>

namespace subvol {

/// Puts a layer of cells around a set of cells: they shrink, and each face of the set's boundary becomes a new cell
/// between its old place and its new one (a hex for a quad, a prism for a triangle).
///
///        o---o---o            o---o---o
///        |   |   |            |\ /|\ /|        faces of the set that lie on the mesh's boundary get a cell as well:
///        |   |   |    ->      | o-o-o |        with all cells the layer lies inside the whole boundary
///        |   |   |            |/ \|/ \|
///        o---o---o            o---o---o
///
/// mesh    passes `validate` but for unused vertices.
/// cells   numbers of the set, each once; or empty: all cells.
/// returns the same cells, those of the set on new vertices, then one cell per face of the set's boundary, by cell and
///         local order. Old vertices keep their numbers and places, and so do tags, which lie on the old boundary; new
///         ones are appended. New cells get their neighbour's reference.
///
/// New vertices move inward by 0.15 of the shortest edge along the sum of the distinct normals around, and less where a
/// cell would be inverted. On a mesh of equal cubes no cell can be inverted where some direction sees all faces around
/// from their front (`VertexRule::pillowable`).
///
/// InputError: a mesh that is not sound; a cell number out of range or given twice; a set whose boundary is no manifold
/// (it touches itself along an edge or at a vertex); a vertex around which no direction keeps all cells valid.
VolumeMesh pillow(const VolumeMesh& mesh, std::span<const Index> cells = {});

}  // namespace subvol
