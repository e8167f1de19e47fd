// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/parallel_errors.h"
#include "subvol/subdivision/sparse_map.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#ifdef __linux__
#include <sys/mman.h>
#endif

namespace subvol::internal {

/// Builds one row of a sparse map: sums the weights of each column in the order in which they are added.
class RowBuilder {
 public:
  explicit RowBuilder(std::size_t num_cols) : slots_(num_cols, kNoIndex) {}

  void add(Index column, double weight) {
    Index& slot = slots_[column];
    if (slot == kNoIndex) {
      slot = static_cast<Index>(keys_.size());
      keys_.push_back(static_cast<std::uint64_t>(column) << 32 | static_cast<std::uint64_t>(slot));
      weights_.push_back(weight);
    } else {
      weights_[slot] += weight;
    }
  }

  /// Appends the row, sorted by column, and empties the builder.
  void flush(std::vector<Index>& columns, std::vector<double>& values) {
    sort_keys();
    const std::size_t first = columns.size(), size = keys_.size();
    columns.resize(first + size);
    values.resize(first + size);
    for (std::size_t i = 0; i < size; ++i) {
      const Index column = static_cast<Index>(keys_[i] >> 32);
      columns[first + i] = column;
      values[first + i] = weights_[static_cast<std::uint32_t>(keys_[i])];
      slots_[column] = kNoIndex;
    }
    keys_.clear();
    weights_.clear();
  }

 private:
  void sort_keys() {
    constexpr std::size_t kInsertionLimit = 32;  // rows of regular meshes have at most 27 entries
    const std::size_t size = keys_.size();
    if (size > kInsertionLimit) {
      std::sort(keys_.begin(), keys_.end());
      return;
    }
    std::uint64_t* keys = keys_.data();
    for (std::size_t i = 1; i < size; ++i) {
      const std::uint64_t key = keys[i];
      std::size_t j = i;
      for (; j > 0 && keys[j - 1] > key; --j) keys[j] = keys[j - 1];
      keys[j] = key;
    }
  }

  std::vector<Index> slots_;         // place of each column in weights_, or kNoIndex
  std::vector<std::uint64_t> keys_;  // column, then slot
  std::vector<double> weights_;
};

/// Asks the system for large pages in the memory that a vector has reserved: fresh memory takes most of the time
/// otherwise.
template <class T>
void prefer_large_pages([[maybe_unused]] std::vector<T>& reserved) {
#ifdef MADV_HUGEPAGE
  constexpr std::size_t kPage = 4096;  // bytes; madvise() asks for whole pages
  void* begin = reserved.data();
  std::size_t size = reserved.capacity() * sizeof(T);
  if (std::align(kPage, kPage, begin, size))
    madvise(begin, size / kPage * kPage, MADV_HUGEPAGE);  // failure does no harm
#endif
}

/// Builds a map row by row, in parallel: fill(i, builder) adds the weights of row i.
///
/// `fill` must depend on i only. Chunks of rows are independent and joined in order, so the result does not depend on
/// the thread count. Throws what `fill` throws, and std::bad_alloc.
template <class Fill>
SparseMap assemble_rows(std::size_t num_rows, std::size_t num_cols, Fill&& fill) {
  // Number of rows that one thread fills, and of such chunks that are joined at a time.
  constexpr std::size_t kChunkRows = 256, kWaveChunks = 8;
  constexpr std::size_t kExpectedRowSize = 16;  // reserved memory that is not used costs address space only
  struct Chunk {
    std::vector<Index> columns;
    std::vector<double> values;
  };
  std::array<Chunk, kWaveChunks> chunks;  // reused by every wave: fresh memory is the main cost here
  SparseMap map;
  map.num_cols = num_cols;
  map.offsets.resize(num_rows + 1);
  map.offsets[0] = 0;
  map.columns.reserve(kExpectedRowSize * num_rows);
  map.values.reserve(kExpectedRowSize * num_rows);
  prefer_large_pages(map.columns);
  prefer_large_pages(map.values);
  const auto fill_chunk = [&](Chunk& chunk, std::size_t first, RowBuilder& row) {
    chunk.columns.clear();
    chunk.values.clear();
    for (std::size_t i = first; i < std::min(num_rows, first + kChunkRows); ++i) {
      fill(i, row);
      row.flush(chunk.columns, chunk.values);
      map.offsets[i + 1] = chunk.columns.size();
    }
  };
  const auto join = [&](const Chunk& chunk, std::size_t first) {
    const std::size_t start = map.columns.size();
    for (std::size_t i = first; i < std::min(num_rows, first + kChunkRows); ++i) map.offsets[i + 1] += start;
    map.columns.insert(map.columns.end(), chunk.columns.begin(), chunk.columns.end());
    map.values.insert(map.values.end(), chunk.values.begin(), chunk.values.end());
  };
  ParallelErrors errors;
#pragma omp parallel if (num_rows > kChunkRows)
  {
    std::optional<RowBuilder> row;
    errors.guard([&] { row.emplace(num_cols); });
    for (std::size_t wave = 0; wave < num_rows; wave += kWaveChunks * kChunkRows) {
#pragma omp for schedule(dynamic)
      for (std::size_t c = 0; c < kWaveChunks; ++c)
        errors.guard([&] { fill_chunk(chunks[c], wave + c * kChunkRows, *row); });
#pragma omp single
      for (std::size_t c = 0; c < kWaveChunks; ++c) errors.guard([&] { join(chunks[c], wave + c * kChunkRows); });
    }
  }
  errors.rethrow();
  return map;
}

}  // namespace subvol::internal
