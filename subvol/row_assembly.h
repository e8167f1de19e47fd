// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/sparse_map.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#ifdef __linux__
#include <sys/mman.h>
#endif

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

/// Asks the system for large pages behind what a vector has reserved: fresh memory costs most of the time otherwise.
template <class T>
void prefer_large_pages([[maybe_unused]] std::vector<T>& reserved) {
#ifdef MADV_HUGEPAGE
  constexpr std::uintptr_t kPage = 4096;
  const auto begin = (reinterpret_cast<std::uintptr_t>(reserved.data()) + kPage - 1) / kPage * kPage;
  const auto end = reinterpret_cast<std::uintptr_t>(reserved.data() + reserved.capacity()) / kPage * kPage;
  if (begin < end) madvise(reinterpret_cast<void*>(begin), end - begin, MADV_HUGEPAGE);  // advice: failure is no harm
#endif
}

/// Builds a map row by row, in parallel: fill(i, builder) adds the weights of row i.
///
/// `fill` must depend on i only and not throw. Chunks of rows are independent and joined in order, so the result does
/// not depend on the thread count.
template <class Fill>
SparseMap assemble_rows(std::size_t num_rows, std::size_t num_cols, Fill&& fill) {
  constexpr std::size_t kChunkRows = 1024, kWaveChunks = 8;
  constexpr std::size_t kExpectedRowSize = 16;  // what is reserved and not used costs address space only
  struct Chunk {
    std::vector<Index> columns;
    std::vector<double> values;
  };
  std::array<Chunk, kWaveChunks> chunks;  // used again by every wave: fresh memory is what costs most here
  SparseMap map;
  map.num_cols = num_cols;
  map.offsets.resize(num_rows + 1);
  map.offsets[0] = 0;
  map.columns.reserve(kExpectedRowSize * num_rows);
  map.values.reserve(kExpectedRowSize * num_rows);
  prefer_large_pages(map.columns);
  prefer_large_pages(map.values);
#pragma omp parallel if (num_rows > kChunkRows)
  {
    RowBuilder row(num_cols);
    for (std::size_t wave = 0; wave < num_rows; wave += kWaveChunks * kChunkRows) {
#pragma omp for schedule(dynamic)
      for (std::size_t c = 0; c < kWaveChunks; ++c) {
        Chunk& chunk = chunks[c];
        chunk.columns.clear();
        chunk.values.clear();
        const std::size_t first = std::min(num_rows, wave + c * kChunkRows);
        for (std::size_t i = first; i < std::min(num_rows, first + kChunkRows); ++i) {
          fill(i, row);
          row.flush(chunk.columns, chunk.values);
          map.offsets[i + 1] = chunk.columns.size();
        }
      }
#pragma omp single
      for (std::size_t c = 0; c < kWaveChunks; ++c) {
        const std::size_t start = map.columns.size(), first = std::min(num_rows, wave + c * kChunkRows);
        for (std::size_t i = first; i < std::min(num_rows, first + kChunkRows); ++i) map.offsets[i + 1] += start;
        map.columns.insert(map.columns.end(), chunks[c].columns.begin(), chunks[c].columns.end());
        map.values.insert(map.values.end(), chunks[c].values.begin(), chunks[c].values.end());
      }
    }
  }
  return map;
}

}  // namespace subvol
