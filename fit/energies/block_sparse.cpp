// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/energies/block_sparse.h"

#include "subvol/base/error.h"
#include "subvol/base/parallel_errors.h"
#include "subvol/base/sort_unique.h"

#include <omp.h>

#include <algorithm>

namespace subvol::internal {

std::size_t BlockSparse::find(Index row, Index column) const {
  const auto first = columns.begin() + static_cast<std::ptrdiff_t>(offsets[row]);
  const auto last = columns.begin() + static_cast<std::ptrdiff_t>(offsets[row + 1]);
  const auto it = std::lower_bound(first, last, column);
  return it != last && *it == column ? static_cast<std::size_t>(it - columns.begin()) : num_entries();
}

void BlockSparse::multiply(std::span<const Vec3> in, std::span<Vec3> out) const {
  if (in.size() != num_rows() || out.size() != num_rows())
    throw InputError("BlockSparse::multiply: in and out must have one point per row");
#pragma omp parallel for schedule(static)
  for (std::size_t i = 0; i < num_rows(); ++i) {
    double x = 0, y = 0, z = 0;
    for (std::size_t k = offsets[i]; k < offsets[i + 1]; ++k) {
      const float* b = block(k);
      const Vec3& p = in[columns[k]];
      x += b[0] * p[0] + b[1] * p[1] + b[2] * p[2];
      y += b[3] * p[0] + b[4] * p[1] + b[5] * p[2];
      z += b[6] * p[0] + b[7] * p[1] + b[8] * p[2];
    }
    out[i] = Vec3(x, y, z);
  }
}

void BlockSparse::set_zero() {
  if (blocks.size() != 9 * num_entries()) {
    blocks.assign(9 * num_entries(), 0.0f);
    return;
  }
#pragma omp parallel for schedule(static)
  for (std::size_t i = 0; i < blocks.size(); ++i) blocks[i] = 0;
}

BlockSparse clique_pattern(std::size_t num_rows, std::span<const std::size_t> offsets, std::span<const Index> nodes) {
  for (Index node : nodes)
    if (node < 0 || static_cast<std::size_t>(node) >= num_rows)
      throw InputError("clique_pattern: nodes must be in [0, num_rows)");
  const std::size_t num_elements = offsets.empty() ? 0 : offsets.size() - 1;
  std::vector<std::size_t> first(num_rows + 1, 0);
  for (Index node : nodes) ++first[node + 1];
  for (std::size_t i = 0; i < num_rows; ++i) first[i + 1] += first[i];
  std::vector<Index> elements(nodes.size());
  std::vector<std::size_t> next(first.begin(), first.end() - 1);
  for (std::size_t e = 0; e < num_elements; ++e)
    for (std::size_t k = offsets[e]; k < offsets[e + 1]; ++k) elements[next[nodes[k]]++] = static_cast<Index>(e);

  // Slices of rows run in parallel; then they are put together.
  constexpr std::size_t kSlice = 1024;
  std::vector<std::vector<Index>> slices((num_rows + kSlice - 1) / kSlice);
  BlockSparse result;
  result.offsets.assign(num_rows + 1, 0);
  const auto fill = [&](std::size_t s) {
    std::vector<Index> row;
    for (std::size_t i = s * kSlice; i < std::min(num_rows, (s + 1) * kSlice); ++i) {
      row.assign(1, static_cast<Index>(i));
      for (std::size_t k = first[i]; k < first[i + 1]; ++k)
        row.insert(row.end(), nodes.begin() + static_cast<std::ptrdiff_t>(offsets[elements[k]]),
                   nodes.begin() + static_cast<std::ptrdiff_t>(offsets[elements[k] + 1]));
      sort_unique(row);
      slices[s].insert(slices[s].end(), row.begin(), row.end());
      result.offsets[i + 1] = row.size();
    }
  };
  ParallelErrors errors;
#pragma omp parallel for schedule(dynamic)
  for (std::size_t s = 0; s < slices.size(); ++s) errors.guard([&] { fill(s); });
  errors.rethrow();
  for (std::size_t i = 0; i < num_rows; ++i) result.offsets[i + 1] += result.offsets[i];
  result.columns.reserve(result.offsets.back());
  for (const std::vector<Index>& slice : slices)
    result.columns.insert(result.columns.end(), slice.begin(), slice.end());
  return result;
}

void add_diagonal_blocks(const SparseMap& map, const SparseMap& map_transposed, const BlockSparse& hessian,
                         std::span<Mat3> diagonal) {
  // Per thread: column j of M, scattered. Allocated outside the parallel region, so that a failure can be reported.
  std::vector<std::vector<double>> weights(omp_get_max_threads(), std::vector<double>(map.num_rows(), 0.0));
#pragma omp parallel
  {
    std::vector<double>& weight = weights[omp_get_thread_num()];
#pragma omp for schedule(dynamic, 64)
    for (std::size_t j = 0; j < map.num_cols; ++j) {
      const auto rows = map_transposed.row_columns(j);
      const auto values = map_transposed.row_values(j);
      for (std::size_t a = 0; a < rows.size(); ++a) weight[rows[a]] = values[a];
      // H is symmetric: the blocks of each row up to its diagonal, those before it twice, make half of D + D^T.
      double sum[9] = {};
      for (std::size_t a = 0; a < rows.size(); ++a)
        for (std::size_t k = hessian.offsets[rows[a]]; k < hessian.offsets[rows[a] + 1]; ++k) {
          const Index column = hessian.columns[k];
          if (column > rows[a]) break;
          const double w = values[a] * weight[column] * (column < rows[a] ? 1 : 0.5);
          if (w == 0) continue;
          for (int e = 0; e < 9; ++e) sum[e] += w * hessian.blocks[9 * k + e];
        }
      for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) diagonal[j](r, c) += sum[3 * r + c] + sum[3 * c + r];
      for (Index i : rows) weight[i] = 0;
    }
  }
}

}  // namespace subvol::internal
