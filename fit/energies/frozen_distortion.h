// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/energies/distortion.h"
#include "fit/simd/wide_matrix.h"

namespace subvol {

/// The second derivative of a distortion at points of eight cells, as numbers that are kept while conjugate gradients
/// multiply with it. Per point: U (9), R V (9), stretch (3), pair_same (3), pair_cross (3), and where stretches are
/// coupled coupling (3), as in `distortion.h`, R being A^-1 and all after it multiplied by the point's weight. Kept in
/// single precision (`keep_frozen`): a product is as fast as they are read. Inlined everywhere: in memory between its
/// steps, a product takes several times as long.
inline constexpr int frozen_size(bool coupled) { return coupled ? 30 : 27; }
inline constexpr int kMostFrozen = frozen_size(true);
/// Symmetric 3x3 blocks of a second derivative by pairs (0,0) (1,1) (2,2) (0,1) (1,2) (2,0) of directions.
inline constexpr int kPairs[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {1, 2}, {2, 0}};

/// Writes a point's numbers. `weight` multiplies the second derivative.
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

/// Keeps a point's numbers; those that single precision has no room for as the largest.
inline void keep_frozen(const Wide* frozen, int size, Narrow* kept) {
  constexpr double kMost = 1e30;
  for (int k = 0; k < size; ++k) {
    Wide x = frozen[k];
    take_lower(x, Wide{} + kMost);
    take_higher(x, Wide{} - kMost);
    kept[k] = narrow(x);
  }
}

/// Makes the second derivative of one lane `factor` times as large; `more` receives the numbers of what was added.
inline void scale_frozen(Narrow* kept, int size, int lane, double factor, Wide* more) {
  for (int k = 0; k < 18; ++k) more[k] = widen(kept[k]);
  for (int k = 18; k < size; ++k) {
    more[k] = Wide{};
    more[k][lane] = (factor - 1) * kept[k][lane];
    kept[k][lane] *= static_cast<float>(factor);
  }
}

/// A change G of the Jacobian, by canonical coordinates, becomes the change U P (R V)^T of the stress:
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

/// Adds, for every pair (c, d) of canonical directions, the symmetric part of the block that couples gradients e_c,
/// e_d.
template <bool kCoupled>
[[gnu::always_inline]] inline void add_blocks(const Wide* frozen, Wide* blocks) {
  const Wide *u = frozen, *rv = frozen + 9, *stretch = frozen + 18, *same = frozen + 21, *cross = frozen + 24;
  for (int pair = 0; pair < 6; ++pair) {
    const Wide *a = rv + 3 * kPairs[pair][0], *b = rv + 3 * kPairs[pair][1];
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

}  // namespace subvol
