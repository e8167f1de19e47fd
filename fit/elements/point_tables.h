// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/elements/high_order_mesh.h"
#include "fit/simd/wide.h"

#include <span>
#include <vector>

namespace subvol {

/// The map of `point_map` for many products: positions at points as dense tables of shape functions that cells share.
///
/// Points that follow one another in the same cell, inside the same vertex, edge or face or the cell itself, form a
/// block: only the modes that do not vanish there count, and blocks of the same kind, modes and points have one table.
/// A boundary sampled alike on every face has few, which stay in the cache; the sparse map's weights do not.
///
/// Same bits for any number of threads. Safe from one thread at a time: products share a buffer.
class PointTables {
 public:
  /// InputError: as of `point_map`. Keeps nothing of the space.
  PointTables(const ElementSpace& space, std::span<const CellPoint> points);

  std::size_t num_rows() const { return num_rows_; }
  std::size_t num_cols() const { return incidence_offsets_.size() - 1; }
  std::size_t num_tables() const { return tables_.size(); }

  /// out = W in: nodes to points. InputError: sizes other than num_cols() and num_rows(). Must not overlap.
  void apply(std::span<const Vec3> in, std::span<Vec3> out) const;
  /// out = W^T in: points to nodes. InputError: sizes other than num_rows() and num_cols(). Must not overlap.
  void apply_transposed(std::span<const Vec3> in, std::span<Vec3> out) const;

 private:
  struct Table {
    std::size_t num_modes;
    std::vector<Wide> values;  ///< of eight points at every mode, then of the next eight; 0 where points are missing
  };
  struct Block {
    std::size_t table, first_row, num_rows, first_place;  ///< the place of its first mode
  };
  std::size_t num_modes(const Block& block) const { return tables_[block.table].num_modes; }
  void find_incidences(std::size_t num_nodes);

  std::size_t num_rows_;
  std::vector<Table> tables_;
  std::vector<Block> blocks_;  ///< those of one table side by side
  /// At every place the node of a mode, as its complement where the mode counts negative; and where each node's are.
  std::vector<Index> signed_nodes_;
  std::vector<std::size_t> incidence_offsets_, incidences_;
  mutable std::vector<Vec3> local_;  ///< coefficients of the blocks' modes, or what they get, by place
};

}  // namespace subvol
