// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/hencky.h"

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

#define SUBVOL_INLINE inline __attribute__((always_inline))

namespace subvol {

namespace {

/// Natural logarithm of a positive normal number in straight-line code, so that loops over lanes vectorise:
/// x = 2^k m with m in [sqrt 1/2, sqrt 2), ln m = 2 artanh((m - 1)/(m + 1)). Relative error below 1e-15.
SUBVOL_INLINE double log_positive(double x) {
  const std::int64_t bits = std::bit_cast<std::int64_t>(x);
  constexpr std::int64_t kSqrtHalf = 0x3fe6a09e667f3bcd;
  const std::int64_t shifted = bits - kSqrtHalf;
  const std::int64_t exponent_bits = shifted & static_cast<std::int64_t>(0xfff0000000000000ull);
  const double m = std::bit_cast<double>(bits - exponent_bits);
  // The exponent as a double without an integer conversion (which AVX2 lacks for 64 bits).
  constexpr double kMagic = 6755399441055744.0;  // 1.5 * 2^52
  const double k =
      std::bit_cast<double>(std::bit_cast<std::int64_t>(kMagic) + (exponent_bits / (std::int64_t{1} << 52))) - kMagic;
  const double s = (m - 1) / (m + 1), s2 = s * s;
  const double series =
      1 + s2 * (1.0 / 3 + s2 * (1.0 / 5 + s2 * (1.0 / 7 + s2 * (1.0 / 9 + s2 * (1.0 / 11 + s2 * (1.0 / 13 + s2 * (1.0 /
      15 + s2 * (1.0 / 17 + s2 * (1.0 / 19)))))))));
  return 2 * s * series + k * 0.6931471805599453;
}

/// One Jacobi rotation that annihilates a_pq of a symmetric 3x3 matrix; r is the third index.
template <bool kVectors>
SUBVOL_INLINE void rotate(double& app, double& aqq, double& apq, double& arp, double& arq, double* vp, double* vq) {
  const double d = aqq - app, twice = 2 * apq;
  const double t = std::copysign(1.0, d) * twice /
                   (std::abs(d) + std::sqrt(d * d + twice * twice) + std::numeric_limits<double>::min());
  const double c = 1 / std::sqrt(1 + t * t), s = t * c;
  app -= t * apq;
  aqq += t * apq;
  apq = 0;
  const double rp = c * arp - s * arq, rq = s * arp + c * arq;
  arp = rp;
  arq = rq;
  if constexpr (kVectors)
    for (int k = 0; k < 3; ++k) {
      const double p = c * vp[k] - s * vq[k], q = s * vp[k] + c * vq[k];
      vp[k] = p;
      vq[k] = q;
    }
}

/// Eigenvalues (and vectors, columns v0 v1 v2) of J^T J. Four cyclic sweeps reach rounding for any stretch ratio.
template <bool kVectors>
SUBVOL_INLINE void right_singular(const double* j, double* lambda, double* v0, double* v1, double* v2) {
  double a00 = j[0] * j[0] + j[3] * j[3] + j[6] * j[6];
  double a11 = j[1] * j[1] + j[4] * j[4] + j[7] * j[7];
  double a22 = j[2] * j[2] + j[5] * j[5] + j[8] * j[8];
  double a01 = j[0] * j[1] + j[3] * j[4] + j[6] * j[7];
  double a12 = j[1] * j[2] + j[4] * j[5] + j[7] * j[8];
  double a02 = j[0] * j[2] + j[3] * j[5] + j[6] * j[8];
  v0[0] = 1, v0[1] = 0, v0[2] = 0;
  v1[0] = 0, v1[1] = 1, v1[2] = 0;
  v2[0] = 0, v2[1] = 0, v2[2] = 1;
#define SUBVOL_SWEEP                                  \
  rotate<kVectors>(a00, a11, a01, a02, a12, v0, v1);  \
  rotate<kVectors>(a11, a22, a12, a01, a02, v1, v2);  \
  rotate<kVectors>(a00, a22, a02, a01, a12, v0, v2);
  SUBVOL_SWEEP SUBVOL_SWEEP SUBVOL_SWEEP SUBVOL_SWEEP
#undef SUBVOL_SWEEP
  lambda[0] = a00;
  lambda[1] = a11;
  lambda[2] = a22;
}

SUBVOL_INLINE double determinant(const double* j) {
  return j[0] * (j[4] * j[8] - j[5] * j[7]) - j[1] * (j[3] * j[8] - j[5] * j[6]) + j[2] * (j[3] * j[7] - j[4] * j[6]);
}

enum class Order { energy, gradient, hessian };

template <Order kOrder>
SUBVOL_INLINE void evaluate_lane(HenckyBatch& b, int l) {
  constexpr bool kVectors = kOrder != Order::energy;
  double j[9], lambda[3], v0[3], v1[3], v2[3];
  for (int k = 0; k < 9; ++k) j[k] = b.jacobian[k][l];
  // Infeasible lanes are computed as if J were the identity, so that nothing in them can overflow or trap.
  const bool feasible = determinant(j) > 0;
  for (int k = 0; k < 9; ++k) j[k] = feasible ? j[k] : (k % 4 == 0 ? 1.0 : 0.0);
  right_singular<kVectors>(j, lambda, v0, v1, v2);
  double log_s[3];
  for (int i = 0; i < 3; ++i) {
    // Rounding may leave an eigenvalue at or below zero when J is nearly singular.
    lambda[i] = lambda[i] > 1e-280 ? lambda[i] : 1e-280;
    log_s[i] = 0.5 * log_positive(lambda[i]);
  }
  const double e = 0.5 * (log_s[0] * log_s[0] + log_s[1] * log_s[1] + log_s[2] * log_s[2]);
  b.energy[l] = feasible ? e : std::numeric_limits<double>::infinity();
  if constexpr (kVectors) {
    double w[3];
    for (int i = 0; i < 3; ++i) w[i] = feasible ? log_s[i] / lambda[i] : 0.0;
    for (int r = 0; r < 3; ++r) {
      const double jv0 = j[3 * r] * v0[0] + j[3 * r + 1] * v0[1] + j[3 * r + 2] * v0[2];
      const double jv1 = j[3 * r] * v1[0] + j[3 * r + 1] * v1[1] + j[3 * r + 2] * v1[2];
      const double jv2 = j[3 * r] * v2[0] + j[3 * r + 1] * v2[1] + j[3 * r + 2] * v2[2];
      for (int c = 0; c < 3; ++c)
        b.stress[3 * r + c][l] = w[0] * jv0 * v0[c] + w[1] * jv1 * v1[c] + w[2] * jv2 * v2[c];
      if constexpr (kOrder == Order::hessian) {
        b.u[3 * r][l] = jv0 / std::sqrt(lambda[0]);
        b.u[3 * r + 1][l] = jv1 / std::sqrt(lambda[1]);
        b.u[3 * r + 2][l] = jv2 / std::sqrt(lambda[2]);
        b.v[3 * r][l] = v0[r];
        b.v[3 * r + 1][l] = v1[r];
        b.v[3 * r + 2][l] = v2[r];
      }
    }
  }
  if constexpr (kOrder == Order::hessian) {
    const double on = feasible ? 1.0 : 0.0;
    double s[3], g[3];
    for (int i = 0; i < 3; ++i) {
      s[i] = std::sqrt(lambda[i]);
      g[i] = log_s[i] / s[i];
      const double stretch = (1 - log_s[i]) / lambda[i];
      b.stretch[i][l] = on * (stretch > kHessianFloor ? stretch : kHessianFloor);
    }
    for (int i = 0; i < 3; ++i) {
      const int k = i == 2 ? 0 : i + 1;
      const double sum = s[i] + s[k], difference = s[i] - s[k];
      const bool close = std::abs(difference) < 1e-4 * sum;
      const double limit = (1 - 0.5 * (log_s[i] + log_s[k])) * 4 / (sum * sum);
      double flip = close ? limit : (g[i] - g[k]) / (close ? 1.0 : difference);
      double twist = (g[i] + g[k]) / sum;
      flip = flip > kHessianFloor ? flip : kHessianFloor;
      twist = twist > kHessianFloor ? twist : kHessianFloor;
      b.pair_same[i][l] = on * 0.5 * (flip + twist);
      b.pair_cross[i][l] = on * 0.5 * (flip - twist);
    }
  }
}

}  // namespace

void hencky_energy(HenckyBatch& batch) {
#pragma omp simd
  for (int l = 0; l < kLanes; ++l) evaluate_lane<Order::energy>(batch, l);
}

void hencky_gradient(HenckyBatch& batch) {
#pragma omp simd
  for (int l = 0; l < kLanes; ++l) evaluate_lane<Order::gradient>(batch, l);
}

void hencky_hessian(HenckyBatch& batch) {
#pragma omp simd
  for (int l = 0; l < kLanes; ++l) evaluate_lane<Order::hessian>(batch, l);
}

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
