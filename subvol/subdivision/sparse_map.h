// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"

#include <cstddef>
#include <span>
#include <vector>

namespace subvol {

/// A sparse linear map between arrays of points, by rows (CSR): out_i = sum_j w_ij in_j for each coordinate.
///
/// Everything that moves with the degrees of freedom is computed by such maps: control vertices -> (S) -> nodes -> (B)
/// -> samples. Gradients go back through the transposed maps. The columns of a row are ascending and unique.
struct SparseMap {
  std::size_t num_cols = 0;
  std::vector<std::size_t> offsets{0};  ///< num_rows() + 1 entries
  std::vector<Index> columns;
  std::vector<double> values;

  std::size_t num_rows() const { return offsets.size() - 1; }
  std::size_t num_nonzeros() const { return columns.size(); }
  std::span<const Index> row_columns(std::size_t i) const { return {columns.data() + offsets[i], row_size(i)}; }
  std::span<const double> row_values(std::size_t i) const { return {values.data() + offsets[i], row_size(i)}; }
  std::size_t row_size(std::size_t i) const { return offsets[i + 1] - offsets[i]; }

  /// out = W in. in.size() == num_cols, out.size() == num_rows() (else InputError); they must not overlap. Rows run in
  /// parallel; every row is summed in column order, so the bits do not depend on the number of threads.
  void apply(std::span<const Vec3> in, std::span<Vec3> out) const;
  std::vector<Vec3> apply(std::span<const Vec3> in) const;

  /// out = W^T in, without a stored transpose: fixed slices of rows are summed in slice order, so the bits do not
  /// depend on the number of threads. For repeated use on small maps, store `transposed()`.
  void apply_transposed(std::span<const Vec3> in, std::span<Vec3> out) const;
};

/// Returns the identity on n points.
SparseMap identity_map(std::size_t n);
/// Returns W^T as a map of its own.
SparseMap transposed(const SparseMap& map);
/// Returns second * first, which applies `first`, then `second`. first.num_rows() == second.num_cols, else InputError.
SparseMap compose(const SparseMap& second, const SparseMap& first);
/// Returns (1 - t) * a + t * b, entry by entry. The maps have equal shapes, else InputError.
SparseMap blend(const SparseMap& a, const SparseMap& b, double t);
/// Returns the given rows of a map, in the given order. rows: in range; a row may be there several times.
SparseMap select_rows(const SparseMap& map, std::span<const Index> rows);

}  // namespace subvol
