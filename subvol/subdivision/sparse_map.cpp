// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/subdivision/sparse_map.h"

#include "subvol/base/error.h"
#include "subvol/subdivision/row_assembly.h"

#include <algorithm>
#include <string>

namespace subvol {

using namespace internal;
namespace {

[[noreturn]] void throw_sizes(const char* function, std::size_t in, std::size_t expected_in, std::size_t out,
                              std::size_t expected_out) {
  throw InputError(std::string(function) + ": expected " + std::to_string(expected_in) + " points in and " +
                   std::to_string(expected_out) + " out, got " + std::to_string(in) + " and " + std::to_string(out));
}

}  // namespace

void SparseMap::apply(std::span<const Vec3> in, std::span<Vec3> out) const {
  if (in.size() != num_cols || out.size() != num_rows())
    throw_sizes("SparseMap::apply", in.size(), num_cols, out.size(), num_rows());
#pragma omp parallel for schedule(static)
  for (std::size_t i = 0; i < num_rows(); ++i) {
    double x = 0, y = 0, z = 0;
    for (std::size_t k = offsets[i]; k < offsets[i + 1]; ++k) {
      const Vec3& p = in[columns[k]];
      x += values[k] * p[0];
      y += values[k] * p[1];
      z += values[k] * p[2];
    }
    out[i] = Vec3(x, y, z);
  }
}

std::vector<Vec3> SparseMap::apply(std::span<const Vec3> in) const {
  std::vector<Vec3> out(num_rows());
  apply(in, out);
  return out;
}

void SparseMap::apply_transposed(std::span<const Vec3> in, std::span<Vec3> out) const {
  if (in.size() != num_rows() || out.size() != num_cols)
    throw_sizes("SparseMap::apply_transposed", in.size(), num_rows(), out.size(), num_cols);
  // A fixed number of slices, each with its own accumulator: the order of every sum is the same for any number of
  // threads.
  constexpr std::size_t kTransposedProductSlices = 8;
  const std::size_t slices = num_rows() < 4096 ? 1 : kTransposedProductSlices;
  std::vector<Vec3> partial(slices * num_cols, Vec3::Zero());
#pragma omp parallel for schedule(static)
  for (std::size_t s = 0; s < slices; ++s) {
    Vec3* sum = partial.data() + s * num_cols;
    for (std::size_t i = num_rows() * s / slices; i < num_rows() * (s + 1) / slices; ++i)
      for (std::size_t k = offsets[i]; k < offsets[i + 1]; ++k) sum[columns[k]] += values[k] * in[i];
  }
#pragma omp parallel for schedule(static)
  for (std::size_t j = 0; j < num_cols; ++j) {
    Vec3 sum = partial[j];
    for (std::size_t s = 1; s < slices; ++s) sum += partial[s * num_cols + j];
    out[j] = sum;
  }
}

SparseMap identity_map(std::size_t n) {
  SparseMap map;
  map.num_cols = n;
  map.offsets.resize(n + 1);
  map.columns.resize(n);
  map.values.assign(n, 1.0);
  for (std::size_t i = 0; i < n; ++i) {
    map.offsets[i + 1] = i + 1;
    map.columns[i] = static_cast<Index>(i);
  }
  return map;
}

SparseMap transposed(const SparseMap& map) {
  SparseMap result;
  result.num_cols = map.num_rows();
  result.offsets.assign(map.num_cols + 1, 0);
  for (Index j : map.columns) ++result.offsets[j + 1];
  for (std::size_t j = 0; j < map.num_cols; ++j) result.offsets[j + 1] += result.offsets[j];
  result.columns.resize(map.num_nonzeros());
  result.values.resize(map.num_nonzeros());
  std::vector<std::size_t> next(result.offsets.begin(), result.offsets.end() - 1);
  for (std::size_t i = 0; i < map.num_rows(); ++i)
    for (std::size_t k = map.offsets[i]; k < map.offsets[i + 1]; ++k) {
      const std::size_t slot = next[map.columns[k]]++;
      result.columns[slot] = static_cast<Index>(i);
      result.values[slot] = map.values[k];
    }
  return result;
}

SparseMap compose(const SparseMap& second, const SparseMap& first) {
  if (first.num_rows() != second.num_cols) throw InputError("compose: first.num_rows() must equal second.num_cols");
  return assemble_rows(second.num_rows(), first.num_cols, [&](std::size_t i, RowBuilder& row) {
    for (std::size_t k = second.offsets[i]; k < second.offsets[i + 1]; ++k) {
      const Index mid = second.columns[k];
      for (std::size_t l = first.offsets[mid]; l < first.offsets[mid + 1]; ++l)
        row.add(first.columns[l], second.values[k] * first.values[l]);
    }
  });
}

SparseMap blend(const SparseMap& a, const SparseMap& b, double t) {
  if (a.num_rows() != b.num_rows() || a.num_cols != b.num_cols) throw InputError("blend: maps of different shapes");
  return assemble_rows(a.num_rows(), a.num_cols, [&](std::size_t i, RowBuilder& row) {
    for (std::size_t k = a.offsets[i]; k < a.offsets[i + 1]; ++k) row.add(a.columns[k], (1 - t) * a.values[k]);
    for (std::size_t k = b.offsets[i]; k < b.offsets[i + 1]; ++k) row.add(b.columns[k], t * b.values[k]);
  });
}

SparseMap select_rows(const SparseMap& map, std::span<const Index> rows) {
  SparseMap result;
  result.num_cols = map.num_cols;
  result.offsets.reserve(rows.size() + 1);
  for (Index i : rows) {
    const auto columns = map.row_columns(i);
    const auto values = map.row_values(i);
    result.columns.insert(result.columns.end(), columns.begin(), columns.end());
    result.values.insert(result.values.end(), values.begin(), values.end());
    result.offsets.push_back(result.columns.size());
  }
  return result;
}

}  // namespace subvol
