// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/energies/distortion.h"
#include "subvol/fit/simd/wide_matrix.h"

namespace subvol::internal {

/// The second derivative of a distortion at points of eight cells, stored for the products of conjugate gradients.
///
/// The numbers of a point: U (9), R V (9), stretch (3), pair_same (3), pair_cross (3) and, if stretches are coupled,
/// coupling (3). They are those of `distortion.h`; R is A^-1, and all numbers after R V are multiplied by the point's
/// weight. They are kept in single precision (`keep_frozen`), because the time of a product is that of reading them.
/// Everything is inlined: with its intermediate results in memory, a product takes several times as long.
inline constexpr int frozen_size(bool coupled) { return coupled ? 30 : 27; }
inline constexpr int kMostFrozen = frozen_size(true);
/// Pairs of directions in the order of symmetric 3x3 blocks: (0,0) (1,1) (2,2) (0,1) (1,2) (2,0).
inline constexpr int kDirectionPairs[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {1, 2}, {2, 0}};

/// Writes a point's numbers to `frozen`. `weight` multiplies the second derivative.
template <bool kCoupled>
[[gnu::always_inline]] inline void freeze(const DistortionBatch& batch, const Wide* reference, const Wide& weight,
                                          Wide* frozen) {
  Wide v[9];
  for (int e = 0; e < 9; ++e) frozen[e] = load_wide(batch.u[e]);
  for (int e = 0; e < 9; ++e) v[e] = load_wide(batch.v[e]);
  product(reference, v, frozen + 9);
  for (int i = 0; i < 3; ++i) {
    frozen[18 + i] = weight * load_wide(batch.stretch[i]);
    frozen[21 + i] = weight * load_wide(batch.pair_same[i]);
    frozen[24 + i] = weight * load_wide(batch.pair_cross[i]);
    if constexpr (kCoupled) frozen[27 + i] = weight * load_wide(batch.coupling[i]);
  }
}

/// Stores a point's numbers in single precision, clamped to the range that it can hold.
inline void keep_frozen(const Wide* frozen, int size, Narrow* kept) {
  // Single precision ends at 3e38; sums of many such numbers stay below that.
  constexpr double kMostFrozenNumber = 1e30;
  for (int k = 0; k < size; ++k) {
    Wide x = frozen[k];
    take_lower(x, Wide{} + kMostFrozenNumber);
    take_higher(x, Wide{} - kMostFrozenNumber);
    kept[k] = narrow(x);
  }
}

/// Multiplies the second derivative of one lane by `factor`; `more` receives the numbers of the increase.
inline void scale_frozen(Narrow* kept, int size, int lane, double factor, Wide* more) {
  for (int k = 0; k < 18; ++k) more[k] = widen(kept[k]);
  for (int k = 18; k < size; ++k) {
    more[k] = Wide{};
    more[k][lane] = (factor - 1) * kept[k][lane];
    kept[k][lane] *= static_cast<float>(factor);
  }
}

/// Replaces a change G of the Jacobian (in canonical coordinates) by the change U P (R V)^T of the stress:
///   W = U^T G R V,  P_ii = stretch_i W_ii + sum_{j != i} coupling_ij W_jj,  P_ij = same_ij W_ij + cross_ij W_ji.
template <bool kCoupled>
[[gnu::always_inline]] inline void apply_frozen(const Narrow* kept, Wide* g) {
  Wide frozen[kMostFrozen];
  for (int k = 0; k < frozen_size(kCoupled); ++k) frozen[k] = widen(kept[k]);
  const Wide *u = frozen, *rv = frozen + 9, *stretch = frozen + 18, *same = frozen + 21, *cross = frozen + 24;
  Wide t[9], w[9], p[9];
  product(g, rv, t);
  transpose_product(u, t, w);
  for (int i = 0; i < 3; ++i) {
    const int j = i == 2 ? 0 : i + 1;
    p[4 * i] = stretch[i] * w[4 * i];
    p[3 * i + j] = same[i] * w[3 * i + j] + cross[i] * w[3 * j + i];
    p[3 * j + i] = same[i] * w[3 * j + i] + cross[i] * w[3 * i + j];
  }
  if constexpr (kCoupled)
    for (int i = 0; i < 3; ++i) {
      const int j = i == 2 ? 0 : i + 1;
      p[4 * i] += frozen[27 + i] * w[4 * j];
      p[4 * j] += frozen[27 + i] * w[4 * i];
    }
  product(u, p, t);
  product_with_transpose(t, rv, g);
}

/// Adds, for every pair (c, d) of canonical directions, the block that couples the gradients e_c and e_d, made
/// symmetric. For c != d this is the sum of both orders, (c, d) and (d, c).
template <bool kCoupled>
[[gnu::always_inline]] inline void add_blocks(const Wide* frozen, Wide* blocks) {
  const Wide *u = frozen, *rv = frozen + 9, *stretch = frozen + 18, *same = frozen + 21, *cross = frozen + 24;
  for (int pair = 0; pair < 6; ++pair) {
    const Wide *a = rv + 3 * kDirectionPairs[pair][0], *b = rv + 3 * kDirectionPairs[pair][1];
    Wide z[9], t[9], k[9];
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3, l = (i + 2) % 3;
      z[4 * i] = stretch[i] * a[i] * b[i] + same[i] * a[j] * b[j] + same[l] * a[l] * b[l];
      z[3 * i + j] = cross[i] * a[j] * b[i];
      z[3 * j + i] = cross[i] * a[i] * b[j];
      if constexpr (kCoupled) {
        z[3 * i + j] += frozen[27 + i] * a[i] * b[j];
        z[3 * j + i] += frozen[27 + i] * a[j] * b[i];
      }
    }
    product(u, z, t);
    product_with_transpose(t, u, k);
    const double both = pair < 3 ? 0.5 : 1;  // (c, d) and (d, c)
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) blocks[9 * pair + 3 * i + j] += both * (k[3 * i + j] + k[3 * j + i]);
  }
}

}  // namespace subvol::internal
