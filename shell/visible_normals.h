// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"
#include "subvol/surface/triangle_mesh.h"

#include <optional>
#include <span>
#include <vector>

namespace subvol {

/// The direction that keeps farthest from being seen edge-on: the unit n with the largest min_i n . m_i, which is the
/// middle of the smallest cap of the sphere around the m_i.
///
/// normals  unit vectors, at least one, else InputError.
/// returns  nothing where min_i n . m_i would not be above 1e-6: no direction sees all sides from their front.
/// Cost: linear in practice, cubic at worst.
std::optional<Vec3> most_visible_direction(std::span<const Vec3> normals);

/// Directions along which a surface can be extruded.
struct VisibleNormals {
  std::vector<Vec3> directions;  ///< unit, one per vertex; 0 where there is none
  std::vector<Index> hidden;     ///< vertices without one, ascending
};

/// For every vertex of a surface the `most_visible_direction` of the faces around it.
///
/// A triangle counts with its normal. A quad counts with the normals at its four corners, so that a thin extrusion of
/// the bilinear patch is nowhere inverted; where these leave no direction, with the one at the vertex only.
/// surface  triangles and quads, each vertex used. Degenerate: a corner without angle has no normal; its vertex is
/// hidden.
VisibleNormals visible_normals(const PolygonMesh& surface);

/// Normal of a polygon at one of its corners, from the two edges there; 0 where they span nothing.
Vec3 corner_normal(const PolygonMesh& surface, std::size_t face, std::size_t corner);

}  // namespace subvol
