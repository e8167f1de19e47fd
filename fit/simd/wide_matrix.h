// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/simd/lanes.h"
#include "subvol/fit/simd/wide.h"

namespace subvol::internal {

static_assert(kWide == kSimdLanes);

/// The eight numbers of a vector, to be set one by one.
inline double* lanes(Wide& w) { return reinterpret_cast<double*>(&w); }

/// c = a b, a b^T or a^T b, for 3x3 matrices stored by rows.
inline void product(const Wide* a, const Wide* b, Wide* c) {
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) c[3 * i + j] = a[3 * i] * b[j] + a[3 * i + 1] * b[3 + j] + a[3 * i + 2] * b[6 + j];
}
inline void product_with_transpose(const Wide* a, const Wide* b, Wide* c) {
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      c[3 * i + j] = a[3 * i] * b[3 * j] + a[3 * i + 1] * b[3 * j + 1] + a[3 * i + 2] * b[3 * j + 2];
}
inline void transpose_product(const Wide* a, const Wide* b, Wide* c) {
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) c[3 * i + j] = a[i] * b[j] + a[3 + i] * b[3 + j] + a[6 + i] * b[6 + j];
}

}  // namespace subvol::internal
