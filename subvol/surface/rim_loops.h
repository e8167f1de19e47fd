// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface/triangle_mesh.h"
#include "subvol/surface/welded_surface.h"

#include <cstddef>
#include <span>
#include <vector>

namespace subvol::internal {

/// An edge of one triangle, in the direction in which that triangle runs along it.
struct RimEdge {
  Index from, to, triangle;
};

/// Returns the loops of edges of one triangle: the rims of holes. Each edge is in one loop, and ends where the next one
/// starts. Where rims touch at a vertex, each has a loop of its own: none passes through a vertex twice.
///
/// mesh  welded and oriented consistently along its rims, without triangles of two equal corners; else InputError: the
///       rim of a hole does not close, with the vertex. Cost: a sort of the edges.
std::vector<std::vector<RimEdge>> rim_loops(const TriangleMesh& mesh);

/// Returns the same for any surface: where triangles disagree about the outside, a walk goes on along an edge that runs
/// the other way, and one that cannot go on ends there.
///
/// rims  edges of one triangle. A walk begins with the first edge that is in none yet, at the smaller vertex.
std::vector<std::vector<RimEdge>> rim_walks(std::span<const SurfaceHalfEdge> rims, std::size_t num_vertices);

}  // namespace subvol::internal
