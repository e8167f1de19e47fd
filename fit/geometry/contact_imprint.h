// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface/triangle_mesh.h"

#include <functional>
#include <optional>

namespace subvol::internal {

/// Triangles no farther apart than this share of the diagonal touch. Files in single precision or with six digits hold
/// planes of assemblies to a tenth of it, and no cell fits into such a gap.
inline constexpr double kTouchingShare = 1e-5;

/// Makes triangles that lie on each other agree: they are cut along each other's edges. So solids that touch, with
/// faces that are cut into other triangles, get equal triangles there: one for each solid.
///
/// Triangles lie on each other if they overlap, seen along the normal of the larger one, and are within
/// `kTouchingShare` of its plane there. They form clusters. A vertex of a cluster that is so near to another one
/// becomes the nearest one that stays, so that none moves farther, and one that is so near to an edge lies on it. The
/// edges of a cluster are the constraints of a Delaunay triangulation in its plane, whose triangles replace those of
/// the cluster; triangles beside it are cut where its vertices lie on their edges.
///
/// surface    finite, with valid vertex numbers.
/// cancelled  asked now and then in all steps, from the calling thread; if it returns true, nothing is returned.
///            Empty: never.
/// returns    the welded surface with its groups, whose shape is that of the given one within `kTouchingShare`. Nothing
///            if no triangles lie on each other but those that have the same corners; if a cluster does not lie in one
///            plane, or two of its vertices are at one place of it; or if there are too many (3e8 tests of a point or a
///            box, 3e7 pairs of boxes that meet in a cluster). What crosses is not looked at: the result may cross as
///            the surface does.
/// Limit: a round contact may be refused if its rim bends by less than the distance from one vertex to the next but
/// one, as that of a polygon of 256 sides does if its radius is below 3 % of the diagonal.
/// Cost: that of the pairs of triangles whose boxes meet and, in a cluster, of edges whose boxes meet.
std::optional<TriangleMesh> imprinted_contacts(const TriangleMesh& surface,
                                               const std::function<bool()>& cancelled = {});

}  // namespace subvol::internal
