// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface/triangle_mesh.h"

#include <span>
#include <vector>

namespace subvol::internal {

/// Measures from each vertex of a surface, along the vertex's own direction, the distance to another part of the
/// surface.
///
/// directions  unit vectors (not checked), one per vertex, else InputError. Triangles that contain the vertex are
///             ignored.
/// returns     one distance per vertex; +infinity if the ray meets nothing, or if it lies in the plane of the first
///             triangle that it meets.
/// Parallel, same result for any number of threads. Cost: some microseconds per vertex.
std::vector<double> ray_gaps(const TriangleMesh& surface, std::span<const Vec3> directions);

}  // namespace subvol::internal
