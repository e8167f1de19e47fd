// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/mesh/volume_mesh.h"
#include "subvol/surface/triangle_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <vector>

namespace subvol {

/// A box of cells in space, equal ones or those between given lines. Cell (i, j, k) has the number
/// i + cells[0] (j + cells[1] k); it reaches from lattice coordinates (i, j, k) to (i + 1, j + 1, k + 1).
struct VoxelGrid {
  std::array<int, 3> cells{1, 1, 1};  ///< number along each axis, >= 1
  Vec3 origin = Vec3::Zero();         ///< equal cells: the corner with the smallest lattice coordinates
  Mat3 edges = Mat3::Identity();      ///< columns: edge vectors of a cell, right-handed; units of `lines` if given
  /// For each axis the positions of its cells + 1 lines, measured from `origin` in units of the axis's edge vector,
  /// strictly increasing; empty: 0, 1, 2, ... (equal cells).
  std::array<std::vector<double>, 3> lines;

  std::size_t num_cells() const {
    return static_cast<std::size_t>(cells[0]) * static_cast<std::size_t>(cells[1]) * static_cast<std::size_t>(cells[2]);
  }
  Index cell(int i, int j, int k) const { return i + cells[0] * (j + cells[1] * k); }
  std::array<int, 3> place(Index cell) const {
    return {cell % cells[0], cell / cells[0] % cells[1], cell / cells[0] / cells[1]};
  }
  /// Maps a lattice coordinate along an axis to a position, in units of the edge vector: linear between two lines,
  /// exact on each, and extended beyond the outer ones.
  double position(std::size_t axis, double coordinate) const {
    if (lines[axis].empty()) return coordinate;
    const double line = std::clamp(std::floor(coordinate), 0.0, cells[axis] - 1.0);
    const double* const low = lines[axis].data() + static_cast<std::size_t>(line);
    return std::lerp(low[0], low[1], coordinate - line);
  }
  /// Maps a position along an axis to a lattice coordinate: the inverse of `position`. Cost: a binary search.
  double coordinate(std::size_t axis, double position) const;
  /// Maps lattice coordinates to space.
  Vec3 point(double i, double j, double k) const {
    return origin + edges * Vec3(position(0, i), position(1, j), position(2, k));
  }
};

/// Returns the box from `low` to `high`, cut into the given number of cells along each axis.
/// InputError: counts < 1, more cells than can be numbered, a corner or difference of corners that is not finite,
/// or high <= low along an axis.
VoxelGrid box_grid(const Vec3& low, const Vec3& high, const std::array<int, 3>& counts);

/// Returns the box from `low` to `high` with cells of about the given size: each axis is cut into equal parts, their
/// number rounded, at least 1. InputError: as above; a size that is not finite and > 0.
VoxelGrid box_grid(const Vec3& low, const Vec3& high, double size);

/// Returns the grid whose cells lie between given lines.
///
/// frame  columns: directions of the axes, right-handed; unit vectors if the lines are in length units.
/// lines  for each axis the positions of its lines along the axis, strictly increasing, at least 2.
/// InputError: fewer lines, lines that are not finite or do not increase, more cells than can be numbered.
VoxelGrid grid_through(const Mat3& frame, std::array<std::vector<double>, 3> lines);

/// Returns the volume of each cell, in units of the volume that the edge vectors span; empty if all cells are equal.
std::vector<double> cell_volumes(const VoxelGrid& grid);

/// Returns the low and high corners of the box around a surface's triangles, moved outward by `margin_percent` % of its
/// diagonal.
std::array<Vec3, 2> box_around(const TriangleMesh& surface, double margin_percent);

/// Returns the kept cells as hexes, in the grid's order, and the lattice points that they use, in lattice order.
/// kept  one entry per cell, non-zero for the cells to keep; empty: all cells.
VolumeMesh voxel_mesh(const VoxelGrid& grid, std::span<const char> kept = {});

}  // namespace subvol
