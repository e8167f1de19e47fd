// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cmath>
#include <cstring>

#ifdef __AVX512F__
#include <immintrin.h>
#endif

namespace subvol {

/// Eight numbers to compute with at once: a vector type of GCC and Clang, on any processor.
inline constexpr int kWide = 8;
using Wide = double __attribute__((vector_size(kWide * sizeof(double))));

/// Eight consecutive doubles, aligned or not.
inline Wide load_wide(const double* from) {
  Wide result;
  std::memcpy(&result, from, sizeof result);
  return result;
}
inline void store_wide(const Wide& value, double* to) { std::memcpy(to, &value, sizeof value); }

/// The same in single precision, for what is kept: half the memory to go through.
using Narrow = float __attribute__((vector_size(kWide * sizeof(float))));
inline Narrow narrow(const Wide& x) { return __builtin_convertvector(x, Narrow); }
inline Wide widen(const Narrow& x) { return __builtin_convertvector(x, Wide); }

/// Lane by lane the lower (higher) of a and b, in a.
inline void take_lower(Wide& a, const Wide& b) { a = b < a ? b : a; }
inline void take_higher(Wide& a, const Wide& b) { a = b > a ? b : a; }

/// Lane by lane |x| where that is higher than a >= 0, in a.
inline void take_higher_size(Wide& a, const Wide& x) {
#ifdef __AVX512DQ__
  a = (Wide)_mm512_range_pd((__m512d)a, (__m512d)x, 0b1011);  // the higher of both sizes, without its sign
#else
  const Wide size = x < 0 ? -x : x;
  a = size > a ? size : a;
#endif
}

/// 1/x and 1/sqrt x for |x| in [1e-300, 1e300], up to two units in the last place.
inline Wide reciprocal(const Wide& x) {
#ifdef __AVX512F__
  // The processor's estimate of 14 bits, doubled twice by Newton's method: a division takes several times as long.
  Wide y = (Wide)_mm512_maskz_rcp14_pd(0xff, (__m512d)x);
  y += y * (1 - x * y);
  return y + y * (1 - x * y);
#else
  return 1 / x;
#endif
}
inline Wide reciprocal_square_root(const Wide& x) {
#ifdef __AVX512F__
  Wide y = (Wide)_mm512_maskz_rsqrt14_pd(0xff, (__m512d)x);
  const Wide half = 0.5 * x;
  y *= 1.5 - half * y * y;
  return y * (1.5 - half * y * y);
#else
  Wide y;
  for (int k = 0; k < kWide; ++k) y[k] = 1 / std::sqrt(x[k]);
  return y;
#endif
}

inline double lowest_lane(const Wide& v) {
  double lowest = v[0];
  for (int k = 1; k < kWide; ++k) lowest = std::min(lowest, v[k]);
  return lowest;
}
inline double highest_lane(const Wide& v) { return -lowest_lane(-v); }

inline double sum_of_lanes(const Wide& v) {
  using Half = double __attribute__((vector_size(kWide / 2 * sizeof(double))));
  const Half sum = __builtin_shufflevector(v, v, 0, 1, 2, 3) + __builtin_shufflevector(v, v, 4, 5, 6, 7);
  return (sum[0] + sum[2]) + (sum[1] + sum[3]);
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
