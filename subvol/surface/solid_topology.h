// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface/triangle_mesh.h"

#include <string>

namespace subvol {

/// Betti numbers of a solid: its components, handles and cavities.
struct BettiNumbers {
  int components = 0;  ///< b0
  int handles = 0;     ///< b1: tunnels through the solid, in all components together
  int cavities = 0;    ///< b2: voids inside
  /// Returns the Euler number of the solid; that of its boundary is twice as large.
  int euler_number() const { return components - handles + cavities; }
  friend bool operator==(const BettiNumbers&, const BettiNumbers&) = default;
};

/// Returns text for people, such as "1 component, 2 handles, 0 cavities".
std::string to_string(const BettiNumbers& numbers);

/// A triangle surface, repaired to bound a solid, and the topology of that solid.
struct SolidBoundary {
  TriangleMesh surface;  ///< closed and oriented outward: every edge runs between two triangles in opposite directions
  BettiNumbers topology;
  double volume = 0;                                                           ///< > 0
  std::size_t flipped_triangles = 0, closed_holes = 0, dropped_triangles = 0;  ///< repairs of the input
};

/// Welds coincident vertices, orients the triangles consistently, closes holes and determines the topology.
///
/// Triangles that share an edge are flipped to agree. A component that lies in an even number of others
/// (`part_nesting`) bounds a solid, one that lies in an odd number is the wall of a void, whatever its orientation: a
/// solid may float in a void. Where solids touch along an edge or at a vertex, each has its own: they stay separate
/// components. Holes are closed by a fan around the mean of their boundary vertices, as if they were disks. Triangles
/// with two equal corners, and those without a neighbor, are dropped. Triangles keep their groups; those that close
/// holes are in none.
///
/// InputError: a vertex number out of range, a position that is not finite, no triangles that share an edge; an edge of
/// more than two triangles that are not those of solids that touch there (`pair_around_edge`), with the number of such
/// edges and the vertices and coordinates of the first ten; a surface that cannot be oriented, or one that encloses no
/// volume. Cost: sorts of the vertices, edges and components.
SolidBoundary solid_boundary(const TriangleMesh& surface);

}  // namespace subvol
