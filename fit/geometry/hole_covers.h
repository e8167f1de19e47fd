// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface/triangle_mesh.h"

#include <cstddef>
#include <optional>

namespace subvol::internal {

/// A surface whose holes are covered.
struct CoveredHoles {
  TriangleMesh surface;   ///< welded (`welded`); the covers are its last triangles, in no group
  std::size_t count = 0;  ///< number of covers
  double area_share = 0;  ///< area of all covers, as a share of that of the given surface
};

/// Covers every hole of a surface by triangles between the vertices of its rim: among those of the Delaunay
/// triangulation of these vertices (or among all if it has none, and the rim has at most 300 vertices) the ones
/// that bend least at their common edges, and then the ones of least area (CGAL). A plane rim gets a plane cover.
///
/// returns  nothing if a hole cannot be covered, if there is none, or if the surface is not oriented consistently along
///          its rims.
/// InputError: as `welded`. Deterministic, serial. Covers may cross each other and the surface.
std::optional<CoveredHoles> cover_holes(const TriangleMesh& surface);

}  // namespace subvol::internal
