// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface/triangle_mesh.h"

#include <vector>

namespace subvol {

/// Polygons with one vertex for every normal: doubled where faces meet at more than an angle.
struct ShadedPolygons {
  std::vector<Vec3> positions, normals;   ///< normals unit
  std::vector<Index> corner_vertices;     ///< vertex of each entry of the mesh's face_vertices
};

/// Mean normals of faces that meet smoothly.
///
/// crease_angle_degrees  in [0, 180]: at a vertex, faces that share an edge and whose normals differ by less are
///                       averaged, by area. 0 gives flat faces.
/// Degenerate: a vertex whose faces have no area gets (0, 0, 1). InputError: a mesh without faces, of faces with fewer
/// than three corners, with indices out of range or positions that are not finite; an angle out of range.
ShadedPolygons shade_polygons(const PolygonMesh& mesh, double crease_angle_degrees = 30);

/// The normals of polygons that have moved, one for each vertex that `corner_vertices` names: faces that were shaded
/// together still are.
///
/// corner_vertices, num_vertices  of a ShadedPolygons of the same polygons elsewhere.
std::vector<Vec3> shaded_normals(const PolygonMesh& mesh, const std::vector<Index>& corner_vertices,
                                 std::size_t num_vertices);

}  // namespace subvol
