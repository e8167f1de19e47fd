// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface/triangle_mesh.h"

#include <vector>

namespace subvol {

/// Triangles that follow the faces of linear cells: a quad face means the bilinear patch of its corners.
///
/// Every edge is halved. A triangle becomes four; a quad, or a larger polygon, becomes the fan of its centre (the mean
/// of its corners, which lies on the patch) over its halved border: eight triangles. They leave the patch of corners p
/// by |p_0 - p_1 + p_2 - p_3| / 16 at most, a quarter of what a diagonal does. Neighbours share their edges' points.
///
/// polygons             each of at least 3 corners, or it gives nothing.
/// polygon_of_triangle  if given: the polygon each triangle comes from. The triangles of one polygon are consecutive.
/// returns              points [corners][edges, by first appearance][centres], orientation kept.
TriangleMesh refined_triangles(const PolygonMesh& polygons, std::vector<Index>* polygon_of_triangle = nullptr);

/// The same surface with as few triangles as describe it: triangles stay as they are, a quad, or a larger polygon,
/// becomes the fan of its centre over its border. Points [corners][centres].
TriangleMesh fan_triangles(const PolygonMesh& polygons, std::vector<Index>* polygon_of_triangle = nullptr);

}  // namespace subvol
