// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"
#include "subvol/surface/triangle_mesh.h"

#include <optional>
#include <span>
#include <vector>

namespace subvol::internal {

/// Returns the direction for which the sides with these normals are farthest from edge-on: the unit vector n with the
/// largest min_i n . m_i, which is the center of the smallest cap of the sphere that contains all m_i.
///
/// normals  unit vectors m_i; at least one, else InputError.
/// returns  nothing if min_i n . m_i would not exceed 1e-6: no direction sees the front of all sides.
/// Cost: linear in practice, cubic at worst.
std::optional<Vec3> most_visible_direction(std::span<const Vec3> normals);

/// Directions along which a surface can be extruded.
struct VisibleNormals {
  std::vector<Vec3> directions;  ///< unit vectors, one per vertex; 0 if there is none
  std::vector<Index> hidden;     ///< vertices without a direction, ascending
};

/// Returns for every vertex of a surface the `most_visible_direction` of the faces around it.
///
/// A triangle contributes its normal. A quad contributes the normals at its four corners, so that a thin extrusion of
/// the bilinear patch is inverted nowhere; if these leave no direction, every face contributes its normal at the vertex
/// only.
///
/// surface  triangles and quads; every vertex is used. Degenerate: a corner with zero angle has no normal, and its
///          vertex is hidden.
VisibleNormals visible_normals(const PolygonMesh& surface);

/// Returns the normal of a polygon at one of its corners, from the two edges there; 0 if they are collinear.
Vec3 corner_normal(const PolygonMesh& surface, std::size_t face, std::size_t corner);

}  // namespace subvol::internal
