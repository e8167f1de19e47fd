// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/sparse_map.h"

#include <algorithm>
#include <utility>
#include <vector>

namespace subvol {

/// One row of a sparse map in the making: sums weights by column, in the order they are added.
class RowBuilder {
 public:
  explicit RowBuilder(std::size_t num_cols) : slots_(num_cols, kNoIndex) {}

  void add(Index column, double weight) {
    Index& slot = slots_[column];
    if (slot == kNoIndex) {
      slot = static_cast<Index>(entries_.size());
      entries_.push_back({column, weight});
    } else {
      entries_[slot].weight += weight;
    }
  }

  /// Appends the row, sorted by column, and empties the builder.
  void flush(std::vector<Index>& columns, std::vector<double>& values) {
    sort_entries();
    for (const Entry& entry : entries_) {
      columns.push_back(entry.column);
      values.push_back(entry.weight);
      slots_[entry.column] = kNoIndex;
    }
    entries_.clear();
  }

 private:
  struct Entry {
    Index column;
    double weight;
  };

  void sort_entries() {
    constexpr std::size_t kInsertionLimit = 32;  // rows of regular meshes have at most 27 entries
    if (entries_.size() > kInsertionLimit) {
      std::sort(entries_.begin(), entries_.end(), [](const Entry& a, const Entry& b) { return a.column < b.column; });
      return;
    }
    for (std::size_t i = 1; i < entries_.size(); ++i) {
      const Entry entry = entries_[i];
      std::size_t j = i;
      for (; j > 0 && entries_[j - 1].column > entry.column; --j) entries_[j] = entries_[j - 1];
      entries_[j] = entry;
    }
  }

  std::vector<Index> slots_;  // place of each column in entries_, or kNoIndex
  std::vector<Entry> entries_;
};

/// Builds a map row by row, in parallel: fill(i, builder) adds the weights of row i.
///
/// `fill` must depend on i only. Chunks of rows are independent, so the result does not depend on the thread count.
template <class Fill>
SparseMap assemble_rows(std::size_t num_rows, std::size_t num_cols, Fill&& fill) {
  constexpr std::size_t kChunkRows = 4096;
  struct Chunk {
    std::vector<Index> columns;
    std::vector<double> values;
  };
  const std::size_t num_chunks = (num_rows + kChunkRows - 1) / kChunkRows;
  std::vector<Chunk> chunks(num_chunks);
  SparseMap map;
  map.num_cols = num_cols;
  map.offsets.resize(num_rows + 1);
  map.offsets[0] = 0;
#pragma omp parallel if (num_chunks > 1)
  {
    RowBuilder row(num_cols);
    Chunk scratch;
#pragma omp for schedule(dynamic)
    for (std::size_t c = 0; c < num_chunks; ++c) {
      scratch.columns.clear();
      scratch.values.clear();
      for (std::size_t i = c * kChunkRows; i < std::min(num_rows, (c + 1) * kChunkRows); ++i) {
        fill(i, row);
        row.flush(scratch.columns, scratch.values);
        map.offsets[i + 1] = scratch.columns.size();
      }
      chunks[c] = scratch;
    }
  }
  std::vector<std::size_t> starts(num_chunks + 1, 0);
  for (std::size_t c = 0; c < num_chunks; ++c) starts[c + 1] = starts[c] + chunks[c].columns.size();
  map.columns.resize(starts.back());
  map.values.resize(starts.back());
#pragma omp parallel for schedule(static) if (num_chunks > 1)
  for (std::size_t c = 0; c < num_chunks; ++c) {
    for (std::size_t i = c * kChunkRows; i < std::min(num_rows, (c + 1) * kChunkRows); ++i)
      map.offsets[i + 1] += starts[c];
    std::copy(chunks[c].columns.begin(), chunks[c].columns.end(), map.columns.begin() + starts[c]);
    std::copy(chunks[c].values.begin(), chunks[c].values.end(), map.values.begin() + starts[c]);
    chunks[c] = {};
  }
  return map;
}

}  // namespace subvol
