// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/types.h"

#include <cstddef>
#include <span>
#include <vector>

namespace subvol {

/// A sparse square matrix of 3x3 blocks by rows: Hessians over nodes or samples.
///
/// Columns of a row are ascending and unique; both halves of a symmetric matrix are stored. Single precision: such a
/// matrix only shapes search directions, and half the bytes are half the time.
struct BlockSparse {
  std::vector<std::size_t> offsets{0};  ///< number of block rows + 1
  std::vector<Index> columns;
  std::vector<float> blocks;            ///< 9 per entry of `columns`, row by row

  std::size_t num_rows() const { return offsets.size() - 1; }

  /// out = H in; sizes num_rows(), no overlap. Rows run in parallel, each summed in order: same bits for any thread count.
  void multiply(std::span<const Vec3> in, std::span<Vec3> out) const;
};

}  // namespace subvol
