// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/elements/element_space.h"
#include "subvol/subdivision/sparse_map.h"

#include <span>
#include <vector>

namespace subvol {

/// A volume mesh of curved cells: a space and one coefficient per node, a vertex's position or a mode's displacement.
struct HighOrderMesh {
  ElementSpace space;
  std::vector<Vec3> coefficients;

  /// InputError: the number of coefficients differs from that of the nodes.
  HighOrderMesh(ElementSpace space, std::vector<Vec3> coefficients);
  /// Makes the straight-sided mesh in a space of any orders: modes are zero. InputError: the space has another number
  /// of vertices.
  HighOrderMesh(ElementSpace space, const VolumeMesh& mesh);

  /// Return x(u), or dx/du (columns are derivatives with respect to u, v, w), at a point of a cell in canonical
  /// coordinates. Slow: every call makes its tables anew; for many points use `point_map` or ShapeFunctions.
  Vec3 position(std::size_t c, const Vec3& point) const;
  Mat3 jacobian(std::size_t c, const Vec3& point) const;

  /// Returns the same mesh in a space of other orders: it keeps its shape if no order falls, otherwise modes are
  /// dropped.
  HighOrderMesh with_orders(const EntityOrders& orders) const;
  /// Returns the linear cells on the same vertices.
  VolumeMesh straight_sided() const;
};

namespace internal {

/// Returns the coefficients of a mesh after the map x -> scale x + shift: modes are displacements, so they are not
/// shifted.
std::vector<Vec3> moved(std::vector<Vec3> coefficients, std::size_t num_vertices, double scale, const Vec3& shift);

}  // namespace internal

/// A point of a cell, in canonical coordinates.
struct CellPoint {
  Index cell;
  Vec3 point;
};

/// Throws InputError, naming `function`, if a cell is out of range, or a point is not finite or more than 1e-9 outside
/// its cell.
void require_inside(const char* function, const ElementSpace& space, std::span<const CellPoint> points);

/// Returns the map from nodes to positions at points, one row per point. Weights within rounding of zero (1e-15) are
/// left out.
///
/// InputError: as `require_inside`. Parallel. For many products: `PointTables`.
SparseMap point_map(const ElementSpace& space, std::span<const CellPoint> points);

}  // namespace subvol
