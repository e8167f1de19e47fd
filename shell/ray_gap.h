// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface/triangle_mesh.h"

#include <span>
#include <vector>

namespace subvol {

/// How far it is from each vertex of a surface, along a direction of its own, to another part of the surface.
///
/// directions  unit, one per vertex, else InputError. Triangles that hold the vertex do not count.
/// returns     one distance per vertex, +infinity where the ray meets nothing.
/// Parallel, same answer for any number of threads. Cost: some microseconds a vertex.
std::vector<double> ray_gaps(const TriangleMesh& surface, std::span<const Vec3> directions);

}  // namespace subvol
