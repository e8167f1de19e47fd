// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"
#include "subvol/surface/surface_topology.h"
#include "subvol/surface/triangle_mesh.h"

#include <array>
#include <cstddef>
#include <span>
#include <vector>

namespace subvol {

/// A plane in which the columns of some vertices on the border of a surface stay.
struct BorderPlane {
  Vec3 normal;                  ///< unit vector
  std::vector<Index> vertices;  ///< on the border, ascending; the plane goes through them
};

/// Largest distance of vertices from a plane that counts as flat, as a share of the diagonal of the surface's bounding
/// box: above the rounding of files in single precision.
inline constexpr double kFlatShare = 1e-6;

/// Finds the flat parts of a surface's border: a loop of border edges in one plane; of other loops, neighboring pieces
/// between turns of more than 30 degrees that are in one plane. One or two straight stretches lie in a plane in any
/// case, and have none. Planes in which faces at the border lie themselves, within 18 degrees, do not count.
std::vector<BorderPlane> flat_border_planes(const PolygonMesh& surface, const SurfaceTopology& topology);

/// The planes of each column of a shell.
class ColumnPlanes {
 public:
  ColumnPlanes() = default;
  /// A vertex may be in two planes, and then its column stays on the line in which they meet; further ones are ignored.
  ColumnPlanes(std::vector<BorderPlane> planes, std::size_t num_columns);

  bool empty() const { return planes_.empty(); }
  std::size_t num_planes() const { return planes_.size(); }
  /// Returns the number of columns that stay in a plane.
  std::size_t num_columns() const;
  /// Removes a column from its planes.
  void release(Index column);

  /// Returns the projector on the directions in which a point moves that belongs to these columns: those of the planes
  /// that all of them have. The identity if there is none.
  Mat3 projector(std::span<const Index> columns) const;

 private:
  std::vector<BorderPlane> planes_;
  std::vector<std::array<Index, 2>> of_column_;
};

}  // namespace subvol
