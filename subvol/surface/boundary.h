// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/mesh/mesh_topology.h"
#include "subvol/mesh/volume_mesh.h"
#include "subvol/surface/triangle_mesh.h"

#include <vector>

namespace subvol {

/// Returns the boundary of a volume mesh: triangles and quads whose normals point out of the cells.
///
/// topology       of this mesh.
/// volume_vertex  if not null, receives the volume mesh's number of every vertex of the result, ascending.
/// returns        one polygon per entry of `topology.boundary_faces()`, in that order and with that first corner, and
///                only the vertices of the boundary. A face in several groups gets the first of them.
PolygonMesh boundary_surface(const VolumeMesh& mesh, const MeshTopology& topology,
                             std::vector<Index>* volume_vertex = nullptr);

/// Cuts every polygon into triangles that keep its orientation, polygon by polygon.
///
/// A quad is cut along its shorter diagonal (the one from its first corner if both are equally long), unless only the
/// other one gives two triangles that face the same side. Larger polygons are cut by ear clipping, the shortest cut
/// first, even if they are far from planar. Positions are copied as they are; a triangle is in its polygon's group.
///
/// polygon_of_triangle  if not null, receives the polygon that each triangle comes from. The triangles of one polygon
///                      are consecutive.
/// Polygons of fewer than three corners yield no triangles. Cost: cubic in the corners of one polygon.
TriangleMesh triangulate(const PolygonMesh& polygons, std::vector<Index>* polygon_of_triangle = nullptr);
/// Returns the triangles as polygons of three corners, in the same order.
PolygonMesh as_polygons(const TriangleMesh& mesh);

}  // namespace subvol
