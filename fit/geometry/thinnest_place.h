// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/geometry/closest_point.h"
#include "subvol/surface/triangle_mesh.h"

#include <array>
#include <functional>
#include <optional>

namespace subvol::internal {

/// A place where two stretches of a surface face each other.
struct ThinPlace {
  double width = 0;                                    ///< distance between the two, > 0, in the surface's unit
  Vec3 at, across;                                     ///< a point of either
  std::array<Index, 2> triangles{kNoIndex, kNoIndex};  ///< that contain these points
};

/// Which side of a surface is looked at.
enum class ThinSide {
  wall,  ///< the solid, behind the triangles
  gap    ///< the space in front of them
};

/// Estimates where a solid, or the space around it, is thinnest.
///
/// From points of the triangles a ball is grown into that side until it touches the surface again, approximately a
/// medial ball. The place counts if the normals of the two stretches are 120 degrees or more apart, if the line across
/// is within 30 degrees of the normal, and if the two triangles have no vertex in common. So the sides of an edge are
/// no wall, unless the edge is sharper than 60 degrees.
///
/// mesh       normals point out of the solid; vertices are welded.
/// tree       of the mesh.
/// cancelled  asked now and then, from the calling thread; if it returns true, nothing is returned. Empty: never.
/// returns    nothing if no two stretches face each other.
/// An estimate: about 20,000 points are tried, evenly spread over the list of triangles, and places that
/// are less than 1 % narrower than the best one so far are passed over. Parallel, with the same result
/// for any number of threads. Cost: about 0.2 s on one core.
std::optional<ThinPlace> thinnest_place(const TriangleMesh& mesh, const ClosestPoint& tree, ThinSide side,
                                        const std::function<bool()>& cancelled = {});

}  // namespace subvol::internal
