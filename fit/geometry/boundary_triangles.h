// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface/triangle_mesh.h"

#include <vector>

namespace subvol::internal {

/// Returns triangles that follow the faces of linear cells: a quad face is the bilinear patch of its corners.
///
/// Every edge is halved. A triangle becomes four; a quad, or a larger polygon, becomes the fan of its center (the mean
/// of its corners, which for a quad lies on the patch) over its halved edges: eight triangles for a quad. They deviate
/// from the patch of corners p by at most |p_0 - p_1 + p_2 - p_3| / 16, a quarter of the deviation of a diagonal.
/// Neighbors share the points of their edges.
///
/// polygons             polygons of fewer than 3 corners give no triangles.
/// polygon_of_triangle  if given, receives the polygon of each triangle. The triangles of one polygon are consecutive.
/// returns              points [corners][edges, by first appearance][centers]; orientation is kept.
TriangleMesh refined_triangles(const PolygonMesh& polygons, std::vector<Index>* polygon_of_triangle = nullptr);

/// Returns the same surface with fewer triangles: triangles stay as they are; a quad, or a larger polygon, becomes the
/// fan of its center over its edges. Points [corners][centers].
TriangleMesh fan_triangles(const PolygonMesh& polygons, std::vector<Index>* polygon_of_triangle = nullptr);

}  // namespace subvol::internal
