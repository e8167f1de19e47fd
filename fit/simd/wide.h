// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <new>
#include <type_traits>
#include <vector>

#ifdef __AVX512F__
#include <immintrin.h>
#endif

namespace subvol::internal {

/// Eight numbers that are processed at once: a vector type of GCC and Clang, on any processor.
inline constexpr int kWide = 8;
using Wide = double __attribute__((vector_size(kWide * sizeof(double))));

/// Loads eight consecutive doubles, aligned or not.
inline Wide load_wide(const double* from) {
  Wide result;
  std::memcpy(&result, from, sizeof result);
  return result;
}
inline void store_wide(const Wide& value, double* to) { std::memcpy(to, &value, sizeof value); }

/// Eight numbers in single precision: half the memory traffic.
using Narrow = float __attribute__((vector_size(kWide * sizeof(float))));
inline void store_wide(const Narrow& value, float* to) { std::memcpy(to, &value, sizeof value); }
inline Narrow narrow(const Wide& x) { return __builtin_convertvector(x, Narrow); }
inline Wide widen(const Narrow& x) { return __builtin_convertvector(x, Wide); }
inline Wide widen(const Wide& x) { return x; }

/// Moves the eight lanes one place up (down); the first (last) lane keeps its value.
template <class Vector>
Vector shifted_up(const Vector& x) {
  return __builtin_shufflevector(x, x, 0, 0, 1, 2, 3, 4, 5, 6);
}
template <class Vector>
Vector shifted_down(const Vector& x) {
  return __builtin_shufflevector(x, x, 1, 2, 3, 4, 5, 6, 7, 7);
}

/// Sixteen numbers in single precision.
inline constexpr int kWideFloats = 16;
using WideFloats = float __attribute__((vector_size(kWideFloats * sizeof(float))));
inline WideFloats load_wide(const float* from) {
  WideFloats result;
  std::memcpy(&result, from, sizeof result);
  return result;
}
inline void store_wide(const WideFloats& value, float* to) { std::memcpy(to, &value, sizeof value); }

/// Loads a vector of consecutive numbers, aligned or not.
template <class Vector>
Vector load(const std::remove_cvref_t<decltype(Vector{}[0])>* from) {
  Vector result;
  std::memcpy(&result, from, sizeof result);
  return result;
}
/// |x|, lane by lane.
template <class Vector>
Vector size_of(const Vector& x) {
  return x < 0 ? -x : x;
}

/// The numbers of an array of vectors, one after the other.
inline float* numbers(Narrow* vectors) { return reinterpret_cast<float*>(vectors); }
inline const float* numbers(const Narrow* vectors) { return reinterpret_cast<const float*>(vectors); }

/// Allocates memory that begins at a cache line, so that vectors of whole lines do not cross any.
template <class Number>
struct AlignedAllocator {
  using value_type = Number;
  static constexpr std::align_val_t kAlignment{sizeof(Wide)};
  AlignedAllocator() = default;
  template <class Other>
  explicit AlignedAllocator(const AlignedAllocator<Other>&) {}
  Number* allocate(std::size_t count) {
    return static_cast<Number*>(::operator new(count * sizeof(Number), kAlignment));
  }
  void deallocate(Number* numbers, std::size_t) { ::operator delete(numbers, kAlignment); }
  bool operator==(const AlignedAllocator&) const = default;
};
using AlignedDoubles = std::vector<double, AlignedAllocator<double>>;
using AlignedFloats = std::vector<float, AlignedAllocator<float>>;

/// Sets each lane of a to the lower (higher) of a and b; a stays if b is not a number.
template <class Vector>
void take_lower(Vector& a, const Vector& b) {
#if defined __AVX512F__ && defined __AVX512VL__
  if constexpr (std::is_same_v<Vector, Wide>)
    a = (Vector)_mm512_min_pd((__m512d)b, (__m512d)a);
  else if constexpr (std::is_same_v<Vector, Narrow>)
    a = (Vector)_mm256_min_ps((__m256)b, (__m256)a);
  else if constexpr (std::is_same_v<Vector, WideFloats>)
    a = (Vector)_mm512_min_ps((__m512)b, (__m512)a);
  else
    a = b < a ? b : a;
#else
  a = b < a ? b : a;
#endif
}
template <class Vector>
void take_higher(Vector& a, const Vector& b) {
#if defined __AVX512F__ && defined __AVX512VL__
  if constexpr (std::is_same_v<Vector, Wide>)
    a = (Vector)_mm512_max_pd((__m512d)b, (__m512d)a);
  else if constexpr (std::is_same_v<Vector, Narrow>)
    a = (Vector)_mm256_max_ps((__m256)b, (__m256)a);
  else if constexpr (std::is_same_v<Vector, WideFloats>)
    a = (Vector)_mm512_max_ps((__m512)b, (__m512)a);
  else
    a = b > a ? b : a;
#else
  a = b > a ? b : a;
#endif
}

/// Sets each lane of a >= 0 to |x| if that is higher.
template <class Vector>
void take_higher_size(Vector& a, const Vector& x) {
#if defined __AVX512DQ__ && defined __AVX512VL__
  constexpr int kWithoutSign = 0b1011;  // the higher of both absolute values
  if constexpr (std::is_same_v<Vector, Wide>)
    a = (Vector)_mm512_range_pd((__m512d)a, (__m512d)x, kWithoutSign);
  else if constexpr (std::is_same_v<Vector, Narrow>)
    a = (Vector)_mm256_range_ps((__m256)a, (__m256)x, kWithoutSign);
  else
    a = (Vector)_mm512_range_ps((__m512)a, (__m512)x, kWithoutSign);
#else
  const Vector size = x < 0 ? -x : x;
  a = size > a ? size : a;
#endif
}

/// 1/x and 1/sqrt x for |x| in [1e-300, 1e300], accurate to two units in the last place.
inline Wide reciprocal(const Wide& x) {
#ifdef __AVX512F__
  // Newton's method doubles the 14 bits of the processor's estimate twice: a division takes several times as long.
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
  using Half = double __attribute__((vector_size(kWide / 2 * sizeof(double))));
  Half lowest = __builtin_shufflevector(v, v, 0, 1, 2, 3);
  take_lower(lowest, __builtin_shufflevector(v, v, 4, 5, 6, 7));
  return std::min(std::min(lowest[0], lowest[1]), std::min(lowest[2], lowest[3]));
}
inline double lowest_lane(const Narrow& v) {
  using Half = float __attribute__((vector_size(kWide / 2 * sizeof(float))));
  Half lowest = __builtin_shufflevector(v, v, 0, 1, 2, 3);
  take_lower(lowest, __builtin_shufflevector(v, v, 4, 5, 6, 7));
  return std::min(std::min(lowest[0], lowest[1]), std::min(lowest[2], lowest[3]));
}
inline double lowest_lane(const WideFloats& v) {
  Narrow lowest = __builtin_shufflevector(v, v, 0, 1, 2, 3, 4, 5, 6, 7);
  take_lower(lowest, __builtin_shufflevector(v, v, 8, 9, 10, 11, 12, 13, 14, 15));
  return lowest_lane(lowest);
}
template <class Vector>
double highest_lane(const Vector& v) {
  return -lowest_lane(-v);
}

inline double sum_of_lanes(const Wide& v) {
  using Half = double __attribute__((vector_size(kWide / 2 * sizeof(double))));
  const Half sum = __builtin_shufflevector(v, v, 0, 1, 2, 3) + __builtin_shufflevector(v, v, 4, 5, 6, 7);
  return (sum[0] + sum[2]) + (sum[1] + sum[3]);
}

/// Bit k is set if v[k] <= limit.
template <class Vector>
unsigned lanes_within(const Vector& v, std::remove_cvref_t<decltype(v[0])> limit) {
#if defined __AVX512F__ && defined __AVX512VL__
  if constexpr (std::is_same_v<Vector, Wide>)
    return _mm512_cmp_pd_mask((__m512d)v, _mm512_set1_pd(limit), _CMP_LE_OQ);
  else if constexpr (std::is_same_v<Vector, Narrow>)
    return _mm256_cmp_ps_mask((__m256)v, _mm256_set1_ps(limit), _CMP_LE_OQ);
  else
    return _mm512_cmp_ps_mask((__m512)v, _mm512_set1_ps(limit), _CMP_LE_OQ);
#else
  unsigned lanes = 0;
  for (int k = 0; k < static_cast<int>(sizeof v / sizeof v[0]); ++k) lanes |= static_cast<unsigned>(v[k] <= limit) << k;
  return lanes;
#endif
}

}  // namespace subvol::internal
