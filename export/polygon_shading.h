// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface/triangle_mesh.h"

#include <vector>

namespace subvol::internal {

/// Polygons with one vertex for every normal: vertices are doubled where faces meet at more than an angle.
struct ShadedPolygons {
  std::vector<Vec3> positions, normals;  ///< normals: of unit length
  std::vector<Index> corner_vertices;    ///< shaded vertex of each entry of the mesh's face_vertices
};

/// Averages the normals of faces that meet smoothly.
///
/// crease_angle_degrees  in [0, 180]: at a vertex, faces that share an edge and whose normals differ by less are
///                       averaged, weighted by area. 0 gives flat faces.
/// Degenerate: a vertex whose faces have no area gets (0, 0, 1). InputError: a mesh without faces, with faces of fewer
/// than three corners, with indices out of range or with positions that are not finite; an angle out of range.
ShadedPolygons shade_polygons(const PolygonMesh& mesh, double crease_angle_degrees = 30);

/// Returns the normals of polygons that have moved, one per shaded vertex: faces that were shaded together still are.
///
/// corner_vertices, num_vertices  those of the ShadedPolygons of the same polygons in another position.
std::vector<Vec3> shaded_normals(const PolygonMesh& mesh, const std::vector<Index>& corner_vertices,
                                 std::size_t num_vertices);

}  // namespace subvol::internal
