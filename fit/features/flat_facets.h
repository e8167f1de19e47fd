// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface/triangle_mesh.h"

#include <vector>

namespace subvol::internal {

/// The points x with normal . x = offset; the normal has length 1.
struct FacetPlane {
  Vec3 normal;
  double offset;
};

/// The flat parts of a surface: connected triangles in one plane. A triangle alone is one, too.
struct FlatFacets {
  std::vector<FacetPlane> planes;
  std::vector<Index> of_triangle;  ///< place in `planes`; kNoIndex for triangles without area
};

/// Vertices of a facet are within this share of the diagonal of its plane: coordinates in files have about 7 digits.
inline constexpr double kFlatTolerance = 1e-6;

/// Divides a surface into flat facets. A facet starts with the largest triangle that is in none and grows over common
/// edges to triangles whose vertices are in its plane; then its plane is fitted to all its triangles: the normal is the
/// mean by area, the offset the mean over the triangles' centers by area.
///
/// surface  vertices of equal position have one number, else facets end between them. Vertex numbers are in range.
/// Deterministic. Cost: sorts of the triangles and edges.
FlatFacets flat_facets(const TriangleMesh& surface);

}  // namespace subvol::internal
