// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/energies/cell_sweep.h"

#include <algorithm>

namespace subvol::internal {

namespace {

/// Stores the sums one by one, so that they can stay in registers until then.
template <int kCount>
[[gnu::always_inline]] inline void put(const Wide (&sums)[kCount], Wide* to) {
  for (int i = 0; i < kCount; ++i) to[i] = sums[i];
}

}  // namespace

void CellSweep::load(std::size_t batch, std::span<const Vec3> nodes) {
  const std::size_t first = batch * group_.num_modes * kSimdLanes;
  for (std::size_t a = 0; a < group_.num_modes; ++a)
    for (int l = 0; l < kSimdLanes; ++l) {
      const Index node = group_.nodes[first + a * kSimdLanes + l];
      const double sign = group_.signs[first + a * kSimdLanes + l];
      for (int r = 0; r < 3; ++r) lanes(coefficients_[3 * a + r])[l] = node == kNoIndex ? 0.0 : sign * nodes[node][r];
    }
}

template <int kCount>
void CellSweep::to_dense(std::size_t first, Wide (*j)[9]) const {
  const Vec3* gradients = group_.gradients.data() + first * group_.num_modes;
  Wide sums[kCount][9] = {};
  for (std::size_t a = 0; a < group_.num_modes; ++a)
    for (int n = 0; n < kCount; ++n)
      for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c)
          sums[n][3 * r + c] += gradients[n * group_.num_modes + a][c] * coefficients_[3 * a + r];
  for (int n = 0; n < kCount; ++n) put(sums[n], j[n]);
}

template <int kCount>
void CellSweep::from_dense(std::size_t first, const Wide (*j)[9]) {
  const Vec3* gradients = group_.gradients.data() + first * group_.num_modes;
  Wide own[kCount][9];  // in registers: for all the compiler knows, j may alias the sums
  for (int n = 0; n < kCount; ++n)
    for (int e = 0; e < 9; ++e) own[n][e] = j[n][e];
  for (std::size_t a = 0; a < group_.num_modes; ++a) {
    Wide sums[3];
    for (int r = 0; r < 3; ++r) sums[r] = sums_[3 * a + r];
    for (int n = 0; n < kCount; ++n) {
      const Vec3& g = gradients[n * group_.num_modes + a];
      for (int r = 0; r < 3; ++r) sums[r] += g[0] * own[n][3 * r] + g[1] * own[n][3 * r + 1] + g[2] * own[n][3 * r + 2];
    }
    put(sums, &sums_[3 * a]);
  }
}

template void CellSweep::to_dense<1>(std::size_t, Wide (*)[9]) const;
template void CellSweep::to_dense<CellSweep::kPointsPerChunk>(std::size_t, Wide (*)[9]) const;
template void CellSweep::from_dense<1>(std::size_t, const Wide (*)[9]);
template void CellSweep::from_dense<CellSweep::kPointsPerChunk>(std::size_t, const Wide (*)[9]);

void CellSweep::expand() {
  const std::size_t num = group_.collapsed.num_functions();
  for (std::size_t m = 0; m < num; m += kPointsPerChunk) {
    Wide j[kPointsPerChunk][9];
    const std::size_t count = std::min<std::size_t>(kPointsPerChunk, num - m);
    count == kPointsPerChunk ? to_dense<kPointsPerChunk>(m, j) : to_dense<1>(m, j);
    for (std::size_t n = 0; n < count; ++n) put(j[n], &expansion_[9 * (m + n)]);
  }
}

void CellSweep::collect() {
  const std::size_t num = group_.collapsed.num_functions();
  for (std::size_t m = 0; m < num; m += kPointsPerChunk) {
    Wide j[kPointsPerChunk][9];
    const std::size_t count = std::min<std::size_t>(kPointsPerChunk, num - m);
    std::copy_n(&expansion_sums_[9 * m], 9 * count, j[0]);
    count == kPointsPerChunk ? from_dense<kPointsPerChunk>(m, j) : from_dense<1>(m, j);
  }
}

void CellSweep::to_collapsed_layer(const CollapsedBasis::Layer& layer) {
  const CollapsedBasis& basis = group_.collapsed;
  const double* along_c = &basis.c[layer.c];
  const Wide* from = expansion_.data();
  for (int i = 0, pair = 0; i <= basis.degree; ++i)
    for (int j = 0; i + j <= basis.degree; ++j, ++pair) {
      const double* factors = along_c + basis.first_pair(i + j);
      Wide sum[9] = {};
      for (int k = 0; i + j + k <= basis.degree; ++k, from += 9)
        for (int e = 0; e < 9; ++e) sum[e] += factors[k] * from[e];
      put(sum, &layer_[9 * pair]);
    }
}

void CellSweep::from_collapsed_layer(const CollapsedBasis::Layer& layer) {
  const CollapsedBasis& basis = group_.collapsed;
  const double* along_c = &basis.c[layer.c];
  Wide* to = expansion_sums_.data();
  for (int i = 0, pair = 0; i <= basis.degree; ++i)
    for (int j = 0; i + j <= basis.degree; ++j, ++pair) {
      const double* factors = along_c + basis.first_pair(i + j);
      Wide sum[9];
      for (int e = 0; e < 9; ++e) sum[e] = layer_sums_[9 * pair + e];
      for (int k = 0; i + j + k <= basis.degree; ++k, to += 9)
        for (int e = 0; e < 9; ++e) to[e] += factors[k] * sum[e];
    }
}

void CellSweep::to_row(const CollapsedBasis::Row& row) {
  const CollapsedBasis& basis = group_.collapsed;
  const double* along_b = &basis.b[row.b];
  for (int i = 0, pair = 0; i <= basis.degree; ++i) {
    Wide sum[9] = {};
    for (int j = 0; i + j <= basis.degree; ++j, ++pair)
      for (int e = 0; e < 9; ++e) sum[e] += along_b[pair] * layer_[9 * pair + e];
    put(sum, &row_[9 * i]);
  }
  for (int q = 0; q < row.num_points; ++q) {
    const double* along_a = &basis.a[row.a + static_cast<std::size_t>(q) * basis.num_lines()];
    Wide sum[9] = {};
    for (int i = 0; i < basis.num_lines(); ++i)
      for (int e = 0; e < 9; ++e) sum[e] += along_a[i] * row_[9 * i + e];
    put(sum, points_[q]);
  }
}

void CellSweep::from_row(const CollapsedBasis::Row& row) {
  const CollapsedBasis& basis = group_.collapsed;
  const double* along_b = &basis.b[row.b];
  for (int i = 0, pair = 0; i <= basis.degree; ++i) {
    Wide sum[9] = {};
    for (int q = 0; q < row.num_points; ++q) {
      const double along_a = basis.a[row.a + static_cast<std::size_t>(q) * basis.num_lines() + i];
      for (int e = 0; e < 9; ++e) sum[e] += along_a * points_[q][e];
    }
    for (int j = 0; i + j <= basis.degree; ++j, ++pair)
      for (int e = 0; e < 9; ++e) layer_sums_[9 * pair + e] += along_b[pair] * sum[e];
  }
}

void CellSweep::to_layer(int layer) {
  std::fill(layer_.begin(), layer_.end(), Wide{});
  const double *values = &group_.values[layer * m_], *derivatives = &group_.derivatives[layer * m_];
  for (std::size_t a = 0; a < group_.num_modes; ++a) {
    const int k = group_.modes[a].k;
    Wide* to = &layer_[6 * group_.triangle_function[a]];
    for (int r = 0; r < 3; ++r) {
      to[r] += values[k] * coefficients_[3 * a + r];
      to[3 + r] += derivatives[k] * coefficients_[3 * a + r];
    }
  }
}

void CellSweep::from_layer(int layer) {
  const double *values = &group_.values[layer * m_], *derivatives = &group_.derivatives[layer * m_];
  for (std::size_t a = 0; a < group_.num_modes; ++a) {
    const int k = group_.modes[a].k;
    const Wide* from = &layer_sums_[6 * group_.triangle_function[a]];
    for (int r = 0; r < 3; ++r) sums_[3 * a + r] += values[k] * from[r] + derivatives[k] * from[3 + r];
  }
}

template <int kCount>
void CellSweep::to_triangle(std::size_t first, Wide (*j)[9]) const {
  const std::size_t num = group_.num_triangle_functions;
  const Vec3* functions = group_.triangle_functions.data() + first * num;
  Wide sums[kCount][9] = {};
  for (std::size_t t = 0; t < num; ++t) {
    const Wide* c = &layer_[6 * t];
    for (int n = 0; n < kCount; ++n) {
      const Vec3& f = functions[n * num + t];
      for (int r = 0; r < 3; ++r) {
        sums[n][3 * r] += f[0] * c[r];
        sums[n][3 * r + 1] += f[1] * c[r];
        sums[n][3 * r + 2] += f[2] * c[3 + r];
      }
    }
  }
  for (int n = 0; n < kCount; ++n) put(sums[n], j[n]);
}

template <int kCount>
void CellSweep::from_triangle(std::size_t first, const Wide (*j)[9]) {
  const std::size_t num = group_.num_triangle_functions;
  const Vec3* functions = group_.triangle_functions.data() + first * num;
  Wide own[kCount][9];
  for (int n = 0; n < kCount; ++n)
    for (int e = 0; e < 9; ++e) own[n][e] = j[n][e];
  for (std::size_t t = 0; t < num; ++t) {
    Wide sums[6];
    for (int r = 0; r < 6; ++r) sums[r] = layer_sums_[6 * t + r];
    for (int n = 0; n < kCount; ++n) {
      const Vec3& f = functions[n * num + t];
      for (int r = 0; r < 3; ++r) {
        sums[r] += f[0] * own[n][3 * r] + f[1] * own[n][3 * r + 1];
        sums[3 + r] += f[2] * own[n][3 * r + 2];
      }
    }
    put(sums, &layer_sums_[6 * t]);
  }
}

template void CellSweep::to_triangle<1>(std::size_t, Wide (*)[9]) const;
template void CellSweep::to_triangle<CellSweep::kPointsPerChunk>(std::size_t, Wide (*)[9]) const;
template void CellSweep::from_triangle<1>(std::size_t, const Wide (*)[9]);
template void CellSweep::from_triangle<CellSweep::kPointsPerChunk>(std::size_t, const Wide (*)[9]);

void CellSweep::to_lines() {
  for (int kj = 0; kj < m_ * m_; ++kj)
    for (int q = 0; q < n_; ++q) {
      Wide sum[6] = {};
      for (int i = 0; i < m_; ++i) {
        const Wide* c = &coefficients_[3 * (kj * m_ + i)];
        const double v = group_.values[q * m_ + i], d = group_.derivatives[q * m_ + i];
        for (int r = 0; r < 3; ++r) {
          sum[r] += v * c[r];
          sum[3 + r] += d * c[r];
        }
      }
      put(sum, &lines_[6 * (static_cast<std::size_t>(kj) * n_ + q)]);
    }
}

void CellSweep::to_planes() {
  for (int k = 0; k < m_; ++k)
    for (int q2 = 0; q2 < n_; ++q2)
      for (int q1 = 0; q1 < n_; ++q1) {
        Wide sum[9] = {};
        for (int j = 0; j < m_; ++j) {
          const Wide* a = &lines_[6 * (static_cast<std::size_t>(k * m_ + j) * n_ + q1)];
          const double v = group_.values[q2 * m_ + j], d = group_.derivatives[q2 * m_ + j];
          for (int r = 0; r < 3; ++r) {
            sum[r] += v * a[3 + r];
            sum[3 + r] += d * a[r];
            sum[6 + r] += v * a[r];
          }
        }
        put(sum, &planes_[9 * ((static_cast<std::size_t>(k) * n_ + q2) * n_ + q1)]);
      }
}

void CellSweep::to_points(std::size_t column, Wide (*j)[9]) const {
  for (int q = 0; q < n_; ++q) {
    const double *v = &group_.values[q * m_], *d = &group_.derivatives[q * m_];
    Wide sum[9] = {};
    for (int k = 0; k < m_; ++k) {
      const Wide* b = &planes_[plane_place(k, column)];
      for (int r = 0; r < 3; ++r) {
        sum[3 * r] += v[k] * b[r];
        sum[3 * r + 1] += v[k] * b[3 + r];
        sum[3 * r + 2] += d[k] * b[6 + r];
      }
    }
    put(sum, j[q]);
  }
}

void CellSweep::from_points(std::size_t column, const Wide (*j)[9]) {
  for (int k = 0; k < m_; ++k) {
    Wide sum[9] = {};
    for (int q = 0; q < n_; ++q) {
      const double v = group_.values[q * m_ + k], d = group_.derivatives[q * m_ + k];
      for (int r = 0; r < 3; ++r) {
        sum[r] += v * j[q][3 * r];
        sum[3 + r] += v * j[q][3 * r + 1];
        sum[6 + r] += d * j[q][3 * r + 2];
      }
    }
    put(sum, &plane_sums_[plane_place(k, column)]);
  }
}

void CellSweep::from_planes() {
  for (int k = 0; k < m_; ++k)
    for (int j = 0; j < m_; ++j)
      for (int q1 = 0; q1 < n_; ++q1) {
        Wide sum[6] = {};
        for (int q2 = 0; q2 < n_; ++q2) {
          const Wide* b = &plane_sums_[9 * ((static_cast<std::size_t>(k) * n_ + q2) * n_ + q1)];
          const double v = group_.values[q2 * m_ + j], d = group_.derivatives[q2 * m_ + j];
          for (int r = 0; r < 3; ++r) {
            sum[r] += d * b[3 + r] + v * b[6 + r];
            sum[3 + r] += v * b[r];
          }
        }
        put(sum, &lines_[6 * (static_cast<std::size_t>(k * m_ + j) * n_ + q1)]);
      }
}

void CellSweep::from_lines() {
  for (int kj = 0; kj < m_ * m_; ++kj)
    for (int i = 0; i < m_; ++i) {
      Wide sum[3] = {};
      for (int q = 0; q < n_; ++q) {
        const Wide* a = &lines_[6 * (static_cast<std::size_t>(kj) * n_ + q)];
        const double v = group_.values[q * m_ + i], d = group_.derivatives[q * m_ + i];
        for (int r = 0; r < 3; ++r) sum[r] += v * a[r] + d * a[3 + r];
      }
      put(sum, &coefficients_[3 * (kj * m_ + i)]);
    }
}

}  // namespace subvol::internal
