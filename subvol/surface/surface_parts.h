// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface/part_nesting.h"
#include "subvol/surface/welded_surface.h"

#include <cstddef>
#include <vector>

namespace subvol::internal {

/// A welded surface, its edges sorted by how many triangles they have, and the parts that its edges connect.
struct SurfaceParts {
  WeldedSurface surface;
  std::vector<SurfaceHalfEdge> sides;              ///< of all triangles, as `sorted_half_edges` returns them
  std::vector<std::array<std::size_t, 2>> joined;  ///< positions in `sides`: pairs of sides that connect two triangles
  std::vector<std::size_t> rims;                   ///< positions in `sides`: edges of one triangle
  /// First position in `sides` of the edges of more than two triangles: those at which solids touch or lie on each
  /// other, whose sides are also in `joined`, and those that connect nothing.
  std::vector<std::size_t> touching, crowded;
  std::vector<int> part;        ///< of each triangle, numbered by the first triangle
  std::vector<char> is_closed;  ///< of each part: no rim and no crowded edge

  std::size_t num_parts() const { return is_closed.size(); }
  /// Returns the sides at an edge, given the position of the first.
  std::span<const SurfaceHalfEdge> edge(std::size_t first) const;
};

/// Finds the parts of a surface. InputError: as `welded`. Cost: that of welding.
SurfaceParts surface_parts(const TriangleMesh& surface);

/// Returns the pairs of triangles that lie on each other at an edge (`contacts_at_edge`), ascending.
std::vector<std::array<Index, 2>> edge_contacts(const SurfaceParts& parts);

/// Turns the closed parts whose orientation disagrees with their nesting (`part_nesting`), so that normals point out of
/// the solid. Triangles inside a part that disagree with their neighbors are not turned.
///
/// nesting  of these parts.
/// returns  the number of parts that were turned.
std::size_t turn_parts_outward(SurfaceParts& parts, const PartNesting& nesting);

}  // namespace subvol::internal
