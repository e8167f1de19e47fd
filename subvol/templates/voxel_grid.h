// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/mesh/volume_mesh.h"
#include "subvol/surface/triangle_mesh.h"

#include <array>
#include <span>

namespace subvol {

/// A box of equal cells in space. Cell (i, j, k) has the number i + cells[0] (j + cells[1] k).
struct VoxelGrid {
  std::array<int, 3> cells{1, 1, 1};  ///< number along each axis, >= 1
  Vec3 origin = Vec3::Zero();         ///< the corner with the smallest lattice coordinates
  Mat3 edges = Mat3::Identity();      ///< columns: edge vectors of a cell, right-handed

  std::size_t num_cells() const {
    return static_cast<std::size_t>(cells[0]) * static_cast<std::size_t>(cells[1]) * static_cast<std::size_t>(cells[2]);
  }
  Index cell(int i, int j, int k) const { return i + cells[0] * (j + cells[1] * k); }
  std::array<int, 3> place(Index cell) const {
    return {cell % cells[0], cell / cells[0] % cells[1], cell / cells[0] / cells[1]};
  }
  /// Maps lattice coordinates to space.
  Vec3 point(double i, double j, double k) const { return origin + edges * Vec3(i, j, k); }
};

/// Returns the box from `low` to `high`, cut into the given number of cells along each axis.
/// InputError: counts < 1, more cells than can be numbered, a corner that is not finite, or high <= low along an axis.
VoxelGrid box_grid(const Vec3& low, const Vec3& high, const std::array<int, 3>& counts);

/// Returns the box from `low` to `high` with cells of about the given size: each axis is cut into equal parts, their
/// number rounded, at least 1. InputError: as above; a size that is not finite and > 0.
VoxelGrid box_grid(const Vec3& low, const Vec3& high, double size);

/// Low and high corners of the box around a surface's triangles, moved outward by `margin_percent` % of its diagonal.
std::array<Vec3, 2> box_around(const TriangleMesh& surface, double margin_percent);

/// Returns the kept cells as hexes, in the grid's order, and the lattice points that they use, in lattice order.
/// kept  one entry per cell, non-zero for the cells to keep; empty: all cells.
VolumeMesh voxel_mesh(const VoxelGrid& grid, std::span<const char> kept = {});

}  // namespace subvol
