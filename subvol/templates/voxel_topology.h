// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"
#include "subvol/surface/solid_topology.h"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace subvol {

/// What is asked of the cells around a lattice point.
enum class VertexRule {
  manifold,   ///< the boundary there is a disc: filled cells hang together by faces, and so do empty ones
  pillowable  ///< and no axis has boundary faces that look both ways: some direction sees all faces from their front
};

/// By the filled ones of the eight cells around a point (bit x + 2y + 4z): whether the rule holds. None and all are
/// good.
const std::array<bool, 256>& vertex_table(VertexRule rule);

/// Cells of a grid, each filled or empty, as a solid whose topology is watched.
///
/// The closed filled cells make the solid. Cells on the grid's outer layer stay empty. Per lattice point the filled
/// cells around are kept as a bit mask; where all points are good by `VertexRule::manifold` the boundary is a
/// 2-manifold and connection through faces, edges and vertices is the same.
class VoxelSolid {
 public:
  /// cells  counts along each axis, >= 3.
  VoxelSolid(const std::array<int, 3>& cells, VertexRule rule);

  bool filled(Index cell) const { return filled_[cell] != 0; }
  std::span<const char> filled() const { return filled_; }
  std::size_t num_filled() const { return num_filled_; }
  std::size_t num_cells() const { return filled_.size(); }
  bool may_flip(Index cell) const { return !outer_[cell]; }
  void flip(Index cell);

  /// Number of a cell's neighbour in each of the six axis directions, and in all 26: offsets to add.
  const std::array<Index, 6>& face_offsets() const { return face_offsets_; }
  const std::array<Index, 26>& all_offsets() const { return all_offsets_; }

  /// Lattice points of a cell, in the order of bits.
  std::array<Index, 8> points(Index cell) const;
  std::size_t num_points() const { return masks_.size(); }
  bool good(Index point) const { return (*table_)[masks_[point]]; }
  /// The eight cells around a point, in the order of bits; kNoIndex outside the grid.
  std::array<Index, 8> cells_around(Index point) const;
  /// How many more points would be good after a flip of this cell; -8 .. 8.
  int good_gain(Index cell) const;
  /// Whether all its points would be good.
  bool good_after_flip(Index cell) const;

  /// The part of a cell's surface that it shares with filled neighbours: faces, edges and vertices as a closed set K.
  struct Contact {
    int components = 0, euler_number = 0;
    std::uint32_t shared = 0, open = 0;  ///< elements in K and outside it, by direction + 13 in base 3
  };
  Contact contact(Index cell) const;
  /// Whether a flip leaves all points good and the solid and its outside as they are, up to deformation: K is a disc.
  bool is_simple(Index cell) const;
  /// Faces (places in face_offsets) of each of the parts of a set of elements, joined where elements touch.
  static std::vector<std::uint32_t> face_groups(std::uint32_t elements);

  /// Betti numbers, by floods through faces and the Euler number: for good points only.
  BettiNumbers topology() const;
  int euler_number() const;
  /// Face-connected component of each cell among those with filled(c) == value, -1 for others. Returns their number.
  int components(bool value, std::vector<int>& component) const;

 private:
  std::array<int, 3> cells_;
  const std::array<bool, 256>* table_;
  std::vector<char> filled_, outer_;
  std::vector<std::uint8_t> masks_;
  std::vector<Index> first_point_;  ///< of each cell: the one of bit 7
  std::array<Index, 6> face_offsets_;
  std::array<Index, 26> all_offsets_;
  std::array<Index, 8> point_offsets_;
  std::size_t num_filled_ = 0;
};

}  // namespace subvol
