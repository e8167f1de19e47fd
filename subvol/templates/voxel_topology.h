// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"
#include "subvol/surface/solid_topology.h"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace subvol::internal {

/// Condition on the cells around a lattice point.
enum class VertexRule {
  manifold,   ///< the boundary there is a disc: the filled cells are connected through faces, and so are the empty ones
  pillowable  ///< and along no axis do boundary faces look both ways: some direction sees all faces from their front
};

/// For each set of filled cells among the eight around a point (bit x + 2y + 4z), true if the rule holds. It holds for
/// no filled cell and for eight.
const std::array<bool, 256>& vertex_table(VertexRule rule);

/// A solid made of the cells of a grid, each filled or empty, that keeps track of its topology.
///
/// The solid is the union of the closed filled cells. Cells on the grid's outer layer stay empty, and frozen cells stay
/// as they are. For each lattice
/// point a bit mask holds the filled cells around it. If all points are good by `VertexRule::manifold`, the boundary is
/// a 2-manifold, and connectivity through faces, edges or vertices is the same.
class VoxelSolid {
 public:
  /// cells  number along each axis, >= 3.
  VoxelSolid(const std::array<int, 3>& cells, VertexRule rule);

  bool filled(Index cell) const { return filled_[cell] != 0; }
  std::span<const char> filled() const { return filled_; }
  std::size_t num_filled() const { return num_filled_; }
  std::size_t num_cells() const { return filled_.size(); }
  bool may_flip(Index cell) const { return !frozen_[cell]; }
  void freeze(Index cell) { frozen_[cell] = 1; }
  void flip(Index cell);

  /// Differences between the number of a cell and those of its neighbors: the 6 across faces, and all 26.
  const std::array<Index, 6>& face_offsets() const { return face_offsets_; }
  const std::array<Index, 26>& all_offsets() const { return all_offsets_; }

  /// Lattice points of a cell; entry b is the point in whose mask the cell has bit b.
  std::array<Index, 8> points(Index cell) const;
  std::size_t num_points() const { return masks_.size(); }
  bool good(Index point) const { return (*table_)[masks_[point]]; }
  /// The eight cells around a point, in the order of the mask's bits; kNoIndex outside the grid.
  std::array<Index, 8> cells_around(Index point) const;
  /// Increase in the number of good points if this cell were flipped, -8 .. 8.
  int good_gain(Index cell) const;
  /// True if all eight points of the cell would be good after flipping it.
  bool good_after_flip(Index cell) const;

  /// True if one of the 26 cells around a cell is not as it is: the others are neither simple nor part of a handle.
  bool is_at_boundary(Index cell) const;

  /// The part of a cell's surface that it shares with filled neighbors: a closed set K of faces, edges and vertices.
  struct Contact {
    int components = 0, euler_number = 0;
    std::uint32_t shared = 0, open = 0;  ///< bit x+1 + 3(y+1) + 9(z+1) for the element in direction (x, y, z): in K,
                                         ///< and outside it
  };
  Contact contact(Index cell) const;
  /// The same for any set of neighbors: bit n for the one at `all_offsets()[n]`.
  static Contact contact_of(std::uint32_t neighbors);
  /// True if a flip leaves all points of the cell good and the solid and its outside unchanged up to deformation: K is
  /// a disc.
  bool is_simple(Index cell) const;
  /// Splits a set of elements into connected parts (elements that touch are joined) and returns for each part its
  /// faces, as bits in the order of face_offsets.
  static std::vector<std::uint32_t> face_groups(std::uint32_t elements);

  /// Betti numbers, from flood fills through faces and the Euler number. All points must be good.
  BettiNumbers topology() const;
  int euler_number() const;
  /// Numbers the face-connected components of the cells with filled(c) == value; -1 for other cells. Returns the number
  /// of components.
  int components(bool value, std::vector<int>& component) const;

 private:
  std::array<int, 3> cells_;
  const std::array<bool, 256>* table_;
  std::vector<char> filled_, frozen_;
  std::vector<std::uint8_t> masks_;
  std::vector<Index> first_point_;  ///< for each cell: the lattice point in whose mask it has bit 7
  std::array<Index, 6> face_offsets_;
  std::array<Index, 26> all_offsets_;
  std::array<Index, 8> point_offsets_;
  std::size_t num_filled_ = 0;
};

}  // namespace subvol::internal
