// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/elements/element_space.h"
#include "subvol/subdivision/sparse_map.h"

#include <span>
#include <vector>

namespace subvol {

/// A volume mesh of curved cells: a space and one coefficient per node, vertices' positions and modes' displacements.
struct HighOrderMesh {
  ElementSpace space;
  std::vector<Vec3> coefficients;

  /// InputError: other than one coefficient per node.
  HighOrderMesh(ElementSpace space, std::vector<Vec3> coefficients);
  /// The straight-sided mesh in a space of any orders: modes are zero. InputError: other than the space's vertices.
  HighOrderMesh(ElementSpace space, const VolumeMesh& mesh);

  /// x(u), and dx/du (columns are derivatives by u, v, w), at a point of a cell in canonical coordinates.
  /// Slow: makes its tables anew; for many points use `point_map` or ShapeFunctions.
  Vec3 position(std::size_t c, const Vec3& point) const;
  Mat3 jacobian(std::size_t c, const Vec3& point) const;

  /// The same mesh in a space of other orders: the same shape where no order falls, else without what is gone.
  HighOrderMesh with_orders(const EntityOrders& orders) const;
  /// The vertices with linear cells between them.
  VolumeMesh straight_sided() const;
};

/// A point of a cell, in canonical coordinates.
struct CellPoint {
  Index cell;
  Vec3 point;
};

/// InputError, in the name of `function`: a cell out of range, a point that is not finite or further than 1e-9 outside
/// its cell.
void require_inside(const char* function, const ElementSpace& space, std::span<const CellPoint> points);

/// Nodes -> positions at points, one row per point. Weights within rounding of zero (1e-15) are left out.
///
/// InputError: as `require_inside`. Parallel. For many products: `PointTables`.
SparseMap point_map(const ElementSpace& space, std::span<const CellPoint> points);

}  // namespace subvol
