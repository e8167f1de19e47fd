// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/mesh/mesh_topology.h"
#include "subvol/mesh/volume_mesh.h"
#include "subvol/surface/triangle_mesh.h"

#include <vector>

namespace subvol {

/// The boundary of a volume mesh: its triangles and quads, normals pointing out of the cells.
///
/// topology       of this mesh.
/// volume_vertex  if given: for every vertex of the result its number in the volume mesh, ascending.
/// returns        one polygon per entry of `topology.boundary_faces()`, in that order and with that first corner; only
///                vertices of the boundary.
PolygonMesh boundary_surface(const VolumeMesh& mesh, const MeshTopology& topology,
                             std::vector<Index>* volume_vertex = nullptr);

/// Cuts every polygon into triangles that keep its orientation, polygon by polygon.
///
/// A quad is cut by its shorter diagonal (the one from its first corner if equally long), unless only the other one
/// keeps both triangles on the same side. Larger polygons lose ears, the shortest cut first; a polygon that is not
/// nearly planar is cut all the same. Positions are copied as they are.
///
/// polygon_of_triangle  if given: the polygon each triangle comes from. The triangles of one polygon are consecutive.
/// Polygons of fewer than three corners give nothing. Cost: cubic in the corners of one polygon.
TriangleMesh triangulate(const PolygonMesh& polygons, std::vector<Index>* polygon_of_triangle = nullptr);
/// Triangles as polygons of three corners, in their order.
PolygonMesh as_polygons(const TriangleMesh& mesh);

}  // namespace subvol
