// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface/triangle_mesh.h"

#include <array>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

namespace subvol::internal {

/// A surface whose vertices of equal position are one vertex.
struct WeldedSurface {
  TriangleMesh mesh;                    ///< only vertices that a triangle names, in the order in which they are named
  std::vector<Index> vertex_numbers;    ///< the smallest number that each vertex has in the input
  std::vector<Index> triangle_numbers;  ///< the number of each triangle in the input, ascending
  std::size_t dropped = 0;              ///< triangles with two corners in one place
};

/// Merges the vertices of equal position and drops the triangles with two corners in one place. Triangles keep their
/// groups.
///
/// InputError: a triangle names a vertex that is not there, or whose position is not finite. Cost: a sort of the
/// vertices.
WeldedSurface welded(const TriangleMesh& surface);

/// Merges the vertices of open edges that have equal positions, so that faces are connected to which a file gives
/// vertices of their own, as for flat shading. Closed parts that touch stay apart.
///
/// Vertices and triangles keep their numbers; vertices that were merged are not named any more. A surface in which a
/// triangle names a vertex that is not there is returned as it is. Cost: a sort of the edges.
TriangleMesh joined_at_open_edges(TriangleMesh surface);

/// Drops all but the first of triangles with the same corners, and their groups.
///
/// returns  the new number of each triangle; of those that were dropped, that of the first one. Cost: a sort.
std::vector<Index> drop_copies(TriangleMesh& mesh);

/// One side of a triangle.
struct SurfaceHalfEdge {
  Index low, high;  ///< its vertices, the smaller number first
  Index triangle;
  bool forward;  ///< true if the triangle runs from `low` to `high`
};

/// Returns the sides of all triangles, those of one edge in succession: sorted by `low`, `high` and `triangle`.
///
/// triangles  of vertices 0 .. num_vertices - 1. One with equal corners has a side from a vertex to itself.
/// Cost: almost linear.
std::vector<SurfaceHalfEdge> sorted_half_edges(std::span<const std::array<Index, 3>> triangles,
                                               std::size_t num_vertices);

/// Calls visit(sides) with the sides of each edge in turn. half_edges: as `sorted_half_edges` returns them.
template <class Visit>
void for_each_edge(std::span<const SurfaceHalfEdge> half_edges, Visit&& visit) {
  for (std::size_t first = 0, last; first < half_edges.size(); first = last) {
    const SurfaceHalfEdge& edge = half_edges[first];
    last = first + 1;
    while (last < half_edges.size() && half_edges[last].low == edge.low && half_edges[last].high == edge.high) ++last;
    visit(half_edges.subspan(first, last - first));
  }
}

/// Returns the angle of each triangle around an edge, and the position of its side in `sides`, ascending.
/// sides  the sides of one edge.
std::vector<std::pair<double, std::size_t>> sorted_around_edge(const TriangleMesh& mesh,
                                                               std::span<const SurfaceHalfEdge> sides);

/// Returns the pairs of triangles, smaller number first, that lie on each other at an edge of more than two: their
/// angles around it are equal up to rounding, and their third corners are different ones.
/// sides  the sides of one edge.
std::vector<std::array<Index, 2>> contacts_at_edge(const TriangleMesh& mesh, std::span<const SurfaceHalfEdge> sides);

/// Pairs the sides at an edge of more than two triangles, such that solids that only touch there stay apart.
///
/// The triangles are sorted by their angle around the edge. Each one that runs forward is paired with the one across
/// the wedge of solid behind it.
///
/// sides     the sides of one edge.
/// outward   true if the triangles' normals point out of the solid, false if they point into it.
/// pairs     receives positions in `sides`.
/// returns   false if no such pairs exist: as many triangles must run forward as backward, in turn.
bool pair_around_edge(const TriangleMesh& mesh, std::span<const SurfaceHalfEdge> sides, bool outward,
                      std::vector<std::array<std::size_t, 2>>& pairs);

/// Returns 1/6 sum of det(a, b, c) over the triangles, relative to the first corner of their part: the volume that a
/// closed surface encloses, negative if its normals point inward. Parts are connected by vertices.
double signed_volume_of(const TriangleMesh& mesh);

}  // namespace subvol::internal
