// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface/triangle_mesh.h"

#include <string>

namespace subvol {

/// How a solid hangs together: its Betti numbers.
struct BettiNumbers {
  int components = 0;  ///< b0
  int handles = 0;     ///< b1: tunnels through the solid, in all components together
  int cavities = 0;    ///< b2: voids inside
  /// Of the solid; its boundary has twice as much.
  int euler_number() const { return components - handles + cavities; }
  friend bool operator==(const BettiNumbers&, const BettiNumbers&) = default;
};

/// "1 component, 2 handles, 0 cavities", for people.
std::string to_string(const BettiNumbers& numbers);

/// A triangle surface made to bound a solid, and that solid's topology.
struct SolidBoundary {
  TriangleMesh surface;  ///< closed and oriented outward: every edge runs between two triangles in opposite directions
  BettiNumbers topology;
  double volume = 0;          ///< > 0
  std::size_t flipped_triangles = 0, closed_holes = 0, dropped_triangles = 0;  ///< what was done to the input
};

/// Welds vertices at the same place, orients triangles alike, closes holes and reads off the topology.
///
/// Triangles that share an edge are turned to agree; a component encloses a solid, or is a void's wall if it was
/// oriented inward and lies in another component's box. Holes are closed by a fan around the mean of their rim, as if
/// they were discs. Triangles with two equal corners, and those without a neighbour, are dropped.
///
/// InputError: more than two triangles at an edge, with the number of such edges and the vertices and coordinates of
/// the first ten; a surface that cannot be oriented, or one that encloses no volume. A vertex with several fans of
/// triangles counts as that many. Cost: sorts of the vertices, edges and components.
SolidBoundary solid_boundary(const TriangleMesh& surface);

}  // namespace subvol
