// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface/triangle_mesh.h"

#include <vector>

namespace subvol::internal {

/// An edge of one triangle, in the direction in which that triangle runs along it.
struct RimEdge {
  Index from, to, triangle;
};

/// Returns the loops of edges of one triangle: the rims of holes. Each edge is in one loop, and ends where the next one
/// starts. Where rims touch at a vertex, loops may pass through it several times.
///
/// mesh  welded and oriented consistently along its rims, without triangles of two equal corners; else InputError: the
///       rim of a hole does not close, with the vertex. Cost: a sort of the edges.
std::vector<std::vector<RimEdge>> rim_loops(const TriangleMesh& mesh);

}  // namespace subvol::internal
