// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/hencky.h"

#include "fit/wide.h"

#include <cstdint>
#include <limits>

#define SUBVOL_INLINE inline __attribute__((always_inline))

namespace subvol {

namespace {

static_assert(kLanes == kWide);

using WideBits = std::int64_t __attribute__((vector_size(kWide * sizeof(std::int64_t))));

SUBVOL_INLINE Wide wide(double x) { return Wide{} + x; }
SUBVOL_INLINE Wide absolute(const Wide& x) { return x < 0 ? -x : x; }
SUBVOL_INLINE Wide load(const double* lanes) { return *reinterpret_cast<const Wide*>(lanes); }
SUBVOL_INLINE void store(const Wide& x, double* lanes) { *reinterpret_cast<Wide*>(lanes) = x; }

/// Natural logarithm of positive normal numbers:
/// x = 2^k m with m in [sqrt 1/2, sqrt 2), ln m = 2 artanh((m - 1)/(m + 1)). Relative error below 1e-15.
SUBVOL_INLINE Wide log_positive(const Wide& x) {
  const WideBits bits = (WideBits)x;
  constexpr std::int64_t kSqrtHalf = 0x3fe6a09e667f3bcd, kExponent = static_cast<std::int64_t>(0xfff0000000000000ull);
  const WideBits exponent_bits = (bits - kSqrtHalf) & kExponent;
  const Wide m = (Wide)(bits - exponent_bits);
  // The exponent as a double without an integer conversion (which AVX2 lacks for 64 bits).
  constexpr double kMagic = 6755399441055744.0;  // 1.5 * 2^52
  const Wide k = (Wide)((WideBits)wide(kMagic) + (exponent_bits >> 52)) - kMagic;
  const Wide s = (m - 1) * reciprocal(m + 1), s2 = s * s;
  const Wide series =
      1 + s2 * (1.0 / 3 + s2 * (1.0 / 5 + s2 * (1.0 / 7 + s2 * (1.0 / 9 + s2 * (1.0 / 11 + s2 * (1.0 / 13 + s2 * (1.0 /
      15 + s2 * (1.0 / 17 + s2 * (1.0 / 19)))))))));
  return 2 * s * series + k * 0.6931471805599453;
}

/// One Jacobi rotation that annihilates a_pq of a symmetric 3x3 matrix with entries of at most 1; r is the third index.
/// By the half angle: cos 2t = |d| / sqrt(d^2 + b^2), d = a_qq - a_pp, b = 2 a_pq.
template <bool kVectors>
SUBVOL_INLINE void rotate(Wide& app, Wide& aqq, Wide& apq, Wide& arp, Wide& arq, Wide* vp, Wide* vq) {
  const Wide d = aqq - app, b = 2 * apq, size = absolute(d) + 1e-150;  // never 0
  const Wide inverse = reciprocal_square_root(size * size + b * b);
  const Wide c2 = 0.5 + 0.5 * size * inverse, inverse_c = reciprocal_square_root(c2);
  const Wide c = c2 * inverse_c, half = 0.5 * b * inverse * inverse_c, s = d < 0 ? -half : half;
  const Wide shift = s * inverse_c * apq;
  app -= shift;
  aqq += shift;
  apq = Wide{};
  const Wide rp = c * arp - s * arq;
  arq = s * arp + c * arq;
  arp = rp;
  if constexpr (kVectors)
    for (int k = 0; k < 3; ++k) {
      const Wide p = c * vp[k] - s * vq[k];
      vq[k] = s * vp[k] + c * vq[k];
      vp[k] = p;
    }
}

/// Eigenvalues (and vectors, columns v0 v1 v2) of J^T J. Four cyclic sweeps reach rounding for any stretch ratio.
template <bool kVectors>
SUBVOL_INLINE void right_singular(const Wide* j, Wide* lambda, Wide* v0, Wide* v1, Wide* v2) {
  Wide a00 = j[0] * j[0] + j[3] * j[3] + j[6] * j[6];
  Wide a11 = j[1] * j[1] + j[4] * j[4] + j[7] * j[7];
  Wide a22 = j[2] * j[2] + j[5] * j[5] + j[8] * j[8];
  const Wide trace = a00 + a11 + a22, scale = reciprocal(trace);
  Wide a01 = scale * (j[0] * j[1] + j[3] * j[4] + j[6] * j[7]);
  Wide a12 = scale * (j[1] * j[2] + j[4] * j[5] + j[7] * j[8]);
  Wide a02 = scale * (j[0] * j[2] + j[3] * j[5] + j[6] * j[8]);
  a00 *= scale, a11 *= scale, a22 *= scale;
  for (int k = 0; k < 3; ++k) {
    v0[k] = wide(k == 0);
    v1[k] = wide(k == 1);
    v2[k] = wide(k == 2);
  }
  for (int sweep = 0; sweep < 4; ++sweep) {
    rotate<kVectors>(a00, a11, a01, a02, a12, v0, v1);
    rotate<kVectors>(a11, a22, a12, a01, a02, v1, v2);
    rotate<kVectors>(a00, a22, a02, a01, a12, v0, v2);
  }
  lambda[0] = trace * a00;
  lambda[1] = trace * a11;
  lambda[2] = trace * a22;
}

SUBVOL_INLINE Wide determinant(const Wide* j) {
  return j[0] * (j[4] * j[8] - j[5] * j[7]) - j[1] * (j[3] * j[8] - j[5] * j[6]) + j[2] * (j[3] * j[7] - j[4] * j[6]);
}

enum class Order { energy, gradient, hessian };

template <Order kOrder>
SUBVOL_INLINE void evaluate(HenckyBatch& batch) {
  constexpr bool kVectors = kOrder != Order::energy;
  Wide j[9], lambda[3], v[3][3], log_s[3];
  for (int k = 0; k < 9; ++k) j[k] = load(batch.jacobian[k]);
  // Infeasible lanes are computed as if J were the identity, so that nothing in them can overflow or trap.
  const WideBits feasible = determinant(j) > 0;
  for (int k = 0; k < 9; ++k) j[k] = feasible ? j[k] : wide(k % 4 == 0 ? 1.0 : 0.0);
  right_singular<kVectors>(j, lambda, v[0], v[1], v[2]);
  for (int i = 0; i < 3; ++i) {
    // Rounding may leave an eigenvalue at or below zero when J is nearly singular.
    lambda[i] = lambda[i] > 1e-280 ? lambda[i] : wide(1e-280);
    log_s[i] = 0.5 * log_positive(lambda[i]);
  }
  const Wide e = 0.5 * (log_s[0] * log_s[0] + log_s[1] * log_s[1] + log_s[2] * log_s[2]);
  store(feasible ? e : wide(std::numeric_limits<double>::infinity()), batch.energy);
  if constexpr (kVectors) {
    const Wide on = feasible ? wide(1) : wide(0);
    Wide inverse_s[3], w[3], jv[3][3];
    for (int i = 0; i < 3; ++i) {
      inverse_s[i] = reciprocal_square_root(lambda[i]);
      w[i] = on * log_s[i] * inverse_s[i] * inverse_s[i];
      for (int r = 0; r < 3; ++r) jv[i][r] = j[3 * r] * v[i][0] + j[3 * r + 1] * v[i][1] + j[3 * r + 2] * v[i][2];
    }
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c)
        store(w[0] * jv[0][r] * v[0][c] + w[1] * jv[1][r] * v[1][c] + w[2] * jv[2][r] * v[2][c],
              batch.stress[3 * r + c]);
    if constexpr (kOrder == Order::hessian) {
      const Wide floor = wide(kHessianFloor);
      Wide s[3], g[3];
      for (int i = 0; i < 3; ++i) {
        for (int r = 0; r < 3; ++r) {
          store(jv[i][r] * inverse_s[i], batch.u[3 * r + i]);
          store(v[i][r], batch.v[3 * r + i]);
        }
        s[i] = lambda[i] * inverse_s[i];
        g[i] = log_s[i] * inverse_s[i];
        const Wide stretch = (1 - log_s[i]) * inverse_s[i] * inverse_s[i];
        store(on * (stretch > floor ? stretch : floor), batch.stretch[i]);
      }
      for (int i = 0; i < 3; ++i) {
        const int k = i == 2 ? 0 : i + 1;
        const Wide sum = s[i] + s[k], difference = s[i] - s[k], inverse_sum = reciprocal(sum);
        const WideBits close = absolute(difference) < 1e-4 * sum;
        const Wide limit = (1 - 0.5 * (log_s[i] + log_s[k])) * 4 * inverse_sum * inverse_sum;
        Wide flip = close ? limit : (g[i] - g[k]) * reciprocal(close ? wide(1) : difference);
        Wide twist = (g[i] + g[k]) * inverse_sum;
        flip = flip > floor ? flip : floor;
        twist = twist > floor ? twist : floor;
        store(on * 0.5 * (flip + twist), batch.pair_same[i]);
        store(on * 0.5 * (flip - twist), batch.pair_cross[i]);
      }
    }
  }
}

}  // namespace

void hencky_energy(HenckyBatch& batch) { evaluate<Order::energy>(batch); }

void hencky_gradient(HenckyBatch& batch) { evaluate<Order::gradient>(batch); }

void hencky_hessian(HenckyBatch& batch) { evaluate<Order::hessian>(batch); }

double hencky(const Mat3& jacobian, Mat3* stress) {
  HenckyBatch batch;
  for (int k = 0; k < 9; ++k)
    for (int l = 0; l < kLanes; ++l) batch.jacobian[k][l] = jacobian(k / 3, k % 3);
  hencky_gradient(batch);
  if (stress)
    for (int k = 0; k < 9; ++k) (*stress)(k / 3, k % 3) = batch.stress[k][0];
  return batch.energy[0];
}

}  // namespace subvol
