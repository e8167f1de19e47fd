// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface/region_surface.h"
#include "subvol/surface/triangle_mesh.h"

#include <cstddef>
#include <vector>

namespace subvol::internal {

/// The faces of a surface that bound one of its regions.
struct RegionFaces {
  PolygonMesh surface;            ///< the given one; the faces that are left are oriented outward from the region
  std::vector<char> is_left_out;  ///< one entry per face: 1 for those that do not bound the region
  std::size_t num_left_out = 0;
};

/// Selects the faces that bound a region and turns those whose normals point into it.
///
/// regions  those of the surface's triangles (`find_regions` of `triangulate(surface)`).
/// region   the number of one of them; kOutsideRegion: the faces between any region and the outside, oriented outward.
/// returns  faces without an area are left out. Of two faces in one place, as solids that share a face have, the second
///          is left out, and vertices at one position are joined where the first has those of the other solid.
/// Cost: a search in a sorted list for each triangle.
RegionFaces faces_of_region(const PolygonMesh& surface, const RegionSurface& regions, int region);

/// Returns true if an edge of the surface has more than two faces: sheets divide its inside then. Vertices of equal
/// position count as one.
bool has_inner_sheets(const PolygonMesh& surface);

}  // namespace subvol::internal
