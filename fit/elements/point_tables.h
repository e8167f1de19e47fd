// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/elements/high_order_mesh.h"
#include "subvol/fit/simd/wide.h"

#include <span>
#include <vector>

namespace subvol::internal {

/// The map of `point_map` for many products: positions at points, from dense tables of shape functions that cells
/// share.
///
/// Consecutive points of one cell that lie at the same vertex, inside the same edge or face, or in the cell's interior,
/// form a block. Only the modes that do not vanish there are used, and blocks of the same kind, modes and points share
/// one table. A boundary that is sampled alike on every face has few tables, which stay in the cache; the sparse map's
/// weights do not.
///
/// Same bits for any number of threads. Use it from one thread at a time: products share a buffer.
class PointTables {
 public:
  /// InputError as for `point_map`. Keeps nothing of the space.
  PointTables(const ElementSpace& space, std::span<const CellPoint> points);

  std::size_t num_rows() const { return num_rows_; }
  std::size_t num_cols() const { return incidence_offsets_.size() - 1; }
  std::size_t num_tables() const { return tables_.size(); }

  /// out = W in: from nodes to points. InputError: sizes other than num_cols() and num_rows(). The spans must not
  /// overlap.
  void apply(std::span<const Vec3> in, std::span<Vec3> out) const;
  /// out = W^T in: from points to nodes. InputError: sizes other than num_rows() and num_cols(). The spans must not
  /// overlap.
  void apply_transposed(std::span<const Vec3> in, std::span<Vec3> out) const;

 private:
  struct Table {
    std::size_t num_modes;
    std::vector<Wide> values;  ///< at eight points for every mode, then at the next eight; 0 for missing points
  };
  struct Block {
    std::size_t table, first_row, num_rows, first_place;  ///< place: of its first mode
  };
  std::size_t num_modes(const Block& block) const { return tables_[block.table].num_modes; }
  void find_incidences(std::size_t num_nodes);

  std::size_t num_rows_;
  std::vector<Table> tables_;
  std::vector<Block> blocks_;  ///< those of one table are adjacent
  /// At every place, the node of a mode, or its complement if the mode's sign is negative; and the places of each node.
  std::vector<Index> signed_nodes_;
  std::vector<std::size_t> incidence_offsets_, incidences_;
  mutable std::vector<Vec3> local_;  ///< by place: coefficients of the blocks' modes, or their sums over points
};

}  // namespace subvol::internal
