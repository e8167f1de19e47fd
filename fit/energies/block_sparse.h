// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"
#include "subvol/subdivision/sparse_map.h"

#include <cstddef>
#include <span>
#include <vector>

namespace subvol::internal {

/// A square sparse matrix of 3x3 blocks over points, stored by rows (CSR): y_i = sum_j B_ij x_j.
///
/// Holds the Hessians of the energies. The columns of a row are ascending and unique. Blocks are single precision (a
/// Newton matrix needs no more, and its product is bound by memory bandwidth); products are summed in double.
struct BlockSparse {
  std::vector<std::size_t> offsets{0};  ///< num_rows() + 1 entries
  std::vector<Index> columns;
  std::vector<float> blocks;  ///< 9 per entry, row-major; empty in a pattern

  std::size_t num_rows() const { return offsets.size() - 1; }
  std::size_t num_entries() const { return columns.size(); }
  const float* block(std::size_t entry) const { return blocks.data() + 9 * entry; }
  float* block(std::size_t entry) { return blocks.data() + 9 * entry; }

  /// Returns the entry number of block (row, column), or num_entries() if the pattern has none. Cost: a binary search
  /// in the row.
  std::size_t find(Index row, Index column) const;

  /// out = B in. Both have num_rows() entries and must not overlap. Rows run in parallel; the result has the same bits
  /// for any number of threads.
  void multiply(std::span<const Vec3> in, std::span<Vec3> out) const;
  /// Sets all blocks to zero; those of a pattern are made.
  void set_zero();
};

/// Returns a pattern, a matrix without blocks, that couples the nodes of every element with one another, and every node
/// with itself.
///
/// Element e has the nodes nodes[offsets[e]] .. nodes[offsets[e+1] - 1], all in [0, num_rows), else InputError.
BlockSparse clique_pattern(std::size_t num_rows, std::span<const std::size_t> offsets, std::span<const Index> nodes);

/// Adds the 3x3 diagonal blocks of M^T H M: D_j += sum_ik M_ij H_ik M_kj. H must be symmetric: H_ki = H_ik^T. Runs in
/// parallel; the result has the same bits for any number of threads.
void add_diagonal_blocks(const SparseMap& map, const SparseMap& map_transposed, const BlockSparse& hessian,
                         std::span<Mat3> diagonal);

}  // namespace subvol::internal
