// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface/triangle_mesh.h"

#include <functional>
#include <optional>

namespace subvol::internal {

/// Makes triangles that overlap in one plane agree: they are cut along each other's edges, and one of each pair of
/// equal ones is left. So solids that touch, with faces that are cut into other triangles, get an interface in common.
///
/// Triangles that overlap form clusters in a plane. The edges of a cluster are the constraints of a Delaunay
/// triangulation there, whose triangles replace those of the cluster; triangles beside it are cut where its vertices
/// lie on their edges.
///
/// surface    finite, with valid vertex numbers.
/// cancelled  asked now and then, from the calling thread; if it returns true, nothing is returned. Empty: never.
/// returns    the welded surface, whose shape is that of the given one up to rounding, with its groups. Nothing if no
///            triangles overlap, if some cross, or if there are too many.
/// Cost: that of `self_intersections`, and the square of the triangles in a cluster.
std::optional<TriangleMesh> imprinted_contacts(const TriangleMesh& surface,
                                               const std::function<bool()>& cancelled = {});

}  // namespace subvol::internal
