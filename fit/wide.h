// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>

#ifdef __AVX512F__
#include <immintrin.h>
#endif

namespace subvol {

/// Eight numbers to compute with at once: a vector type of GCC and Clang, on any processor.
inline constexpr int kWide = 8;
using Wide = double __attribute__((vector_size(kWide * sizeof(double))));

/// Lane by lane the lower (higher) of a and b, in a.
inline void take_lower(Wide& a, const Wide& b) { a = b < a ? b : a; }
inline void take_higher(Wide& a, const Wide& b) { a = b > a ? b : a; }

inline double lowest_lane(const Wide& v) {
  double lowest = v[0];
  for (int k = 1; k < kWide; ++k) lowest = std::min(lowest, v[k]);
  return lowest;
}

/// Bit k tells whether v[k] <= limit.
inline unsigned lanes_within(const Wide& v, double limit) {
#ifdef __AVX512F__
  return _mm512_cmp_pd_mask(_mm512_loadu_pd(reinterpret_cast<const double*>(&v)), _mm512_set1_pd(limit), _CMP_LE_OQ);
#else
  unsigned lanes = 0;
  for (int k = 0; k < kWide; ++k) lanes |= static_cast<unsigned>(v[k] <= limit) << k;
  return lanes;
#endif
}

}  // namespace subvol
