// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/energies/distortion.h"

#include "subvol/fit/energies/singular_values.h"

#include <cmath>
#include <cstdint>
#include <limits>

namespace subvol::internal {

namespace {

static_assert(kSimdLanes == kWide);

using WideBits = std::int64_t __attribute__((vector_size(kWide * sizeof(std::int64_t))));

[[gnu::always_inline]] inline Wide load(const double* lanes) { return *reinterpret_cast<const Wide*>(lanes); }
[[gnu::always_inline]] inline void store(const Wide& x, double* lanes) { *reinterpret_cast<Wide*>(lanes) = x; }

/// Natural logarithm of positive normal numbers:
/// x = 2^k m with m in [sqrt 1/2, sqrt 2), ln m = 2 artanh((m - 1)/(m + 1)). Relative error below 1e-15.
[[gnu::always_inline]] inline Wide log_positive(const Wide& x) {
  const WideBits bits = (WideBits)x;
  constexpr std::int64_t kSqrtHalf = 0x3fe6a09e667f3bcd, kExponent = static_cast<std::int64_t>(0xfff0000000000000ull);
  const WideBits exponent_bits = (bits - kSqrtHalf) & kExponent;
  const Wide m = (Wide)(bits - exponent_bits);
  // The exponent as a double without an integer conversion (which AVX2 lacks for 64 bits).
  constexpr double kIntegerToDoubleOffset = 6755399441055744.0;  // 1.5 * 2^52
  const Wide k = (Wide)((WideBits)wide(kIntegerToDoubleOffset) + (exponent_bits >> 52)) - kIntegerToDoubleOffset;
  const Wide s = (m - 1) * reciprocal(m + 1), s2 = s * s;
  const Wide series =
      1 +
      s2 *
          (1.0 / 3 +
           s2 * (1.0 / 5 +
                 s2 * (1.0 / 7 +
                       s2 * (1.0 / 9 + s2 * (1.0 / 11 +
                                             s2 * (1.0 / 13 + s2 * (1.0 / 15 + s2 * (1.0 / 17 + s2 * (1.0 / 19)))))))));
  return 2 * s * series + k * 0.6931471805599453;
}

/// Raises the eigenvalues of a symmetric matrix to the floor.
[[gnu::always_inline]] inline void clamp_symmetric(Symmetric& a, const Wide& floor) {
  Wide sum = wide(1e-300);
  for (int i = 0; i < 3; ++i) sum += absolute(a.diagonal[i]) + absolute(a.coupled[i]);
  const Wide scale = reciprocal(sum);
  for (int i = 0; i < 3; ++i) a.diagonal[i] *= scale, a.coupled[i] *= scale;
  Wide v[3][3], av[3][3];
  isolated_eigenvector(a, v[0]);
  complete_basis(v[0], v[1], v[2]);
  const auto apply = [&](const Wide* x, Wide* ax) {
    ax[0] = a.diagonal[0] * x[0] + a.coupled[0] * x[1] + a.coupled[2] * x[2];
    ax[1] = a.coupled[0] * x[0] + a.diagonal[1] * x[1] + a.coupled[1] * x[2];
    ax[2] = a.coupled[2] * x[0] + a.coupled[1] * x[1] + a.diagonal[2] * x[2];
  };
  for (int e = 0; e < 3; ++e) apply(v[e], av[e]);
  const Rotation rotation(dot(v[1], av[1]), dot(v[2], av[2]), dot(v[1], av[2]));
  rotation.turn(v[1], v[2]);
  rotation.turn(av[1], av[2]);
  a = {};
  for (int e = 0; e < 3; ++e) {
    Wide value = sum * dot(v[e], av[e]);
    value = value > floor ? value : floor;
    for (int i = 0; i < 3; ++i) {
      a.diagonal[i] += value * v[e][i] * v[e][i];
      a.coupled[i] += value * v[e][i] * v[e][i == 2 ? 0 : i + 1];
    }
  }
}

[[gnu::always_inline]] inline Wide determinant(const Wide* j) {
  return j[0] * (j[4] * j[8] - j[5] * j[7]) - j[1] * (j[3] * j[8] - j[5] * j[6]) + j[2] * (j[3] * j[7] - j[4] * j[6]);
}

enum class Order { energy, gradient, hessian };

[[gnu::always_inline]] inline Wide exponential(const Wide& x) {
  Wide result;
  for (int l = 0; l < kSimdLanes; ++l) result[l] = std::exp(x[l]);
  return result;
}

/// A distortion f as a function of x_i = ln s_i: its value, its first derivatives, and its second derivatives with
/// respect to x_i twice (`second`) and to x_i and x_j for (i, j) = (0,1), (1,2), (2,0) (`mixed`).
struct LogModel {
  Wide value, first[3], second[3], mixed[3];
};

template <Distortion kDistortion>
[[gnu::always_inline]] inline LogModel log_model(const Wide* lambda, const Wide* x) {
  LogModel f;
  if constexpr (kDistortion == Distortion::hencky) {
    f.value = 0.5 * (x[0] * x[0] + x[1] * x[1] + x[2] * x[2]);
    for (int i = 0; i < 3; ++i) f.first[i] = x[i], f.second[i] = wide(1), f.mixed[i] = Wide{};
  } else if constexpr (kDistortion == Distortion::inverse_mean_ratio) {
    // q_i = s_i^2 / det^(2/3),  f = mean q - 1,  dq_i/dx_j = q_i (2 delta_ij - 2/3)
    const Wide inverse = exponential((-2.0 / 3) * (x[0] + x[1] + x[2]));
    const Wide q[3] = {lambda[0] * inverse, lambda[1] * inverse, lambda[2] * inverse};
    const Wide mean = (q[0] + q[1] + q[2]) * (1.0 / 3);
    f.value = mean - 1;
    for (int i = 0; i < 3; ++i) {
      const int j = i == 2 ? 0 : i + 1;
      f.first[i] = (2.0 / 3) * (q[i] - mean);
      f.second[i] = (4.0 / 9) * (q[i] + mean);
      f.mixed[i] = (4.0 / 9) * (mean - q[i] - q[j]);
    }
  } else {
    // f = k - 1,  k = sqrt(P Q) / 3,  P = sum s^2,  Q = sum s^-2,  a_i = s_i^2 / P,  b_i = s_i^-2 / Q:
    // d ln k / dx_i = a_i - b_i
    const Wide inverse[3] = {reciprocal(lambda[0]), reciprocal(lambda[1]), reciprocal(lambda[2])};
    const Wide p = lambda[0] + lambda[1] + lambda[2], q = inverse[0] + inverse[1] + inverse[2], product = p * q;
    const Wide k = (1.0 / 3) * product * reciprocal_square_root(product), one_p = reciprocal(p), one_q = reciprocal(q);
    Wide a[3], b[3];
    for (int i = 0; i < 3; ++i) a[i] = lambda[i] * one_p, b[i] = inverse[i] * one_q;
    f.value = k - 1;
    for (int i = 0; i < 3; ++i) {
      const int j = i == 2 ? 0 : i + 1;
      const Wide g = a[i] - b[i], h = a[j] - b[j];
      f.first[i] = k * g;
      f.second[i] = k * (2 * a[i] * (1 - a[i]) + 2 * b[i] * (1 - b[i]) + g * g);
      f.mixed[i] = k * (g * h - 2 * a[i] * a[j] - 2 * b[i] * b[j]);
    }
  }
  return f;
}

/// Stores the clamped second derivatives with respect to singular values: e_i = f_i / s_i,
/// e_ij = (f_ij - delta_ij f_i) / (s_i s_j).
template <Distortion kDistortion>
[[gnu::always_inline]] inline void store_second(const LogModel& f, const Wide* lambda, const Wide* inverse_s,
                                                const Wide& on, DistortionBatch& batch) {
  const Wide floor = wide(batch.floor);
  Wide s[3], g[3];
  Symmetric stretch;  // coupled: the mixed derivatives
  for (int i = 0; i < 3; ++i) {
    s[i] = lambda[i] * inverse_s[i];
    g[i] = f.first[i] * inverse_s[i];
    stretch.diagonal[i] = (f.second[i] - f.first[i]) * inverse_s[i] * inverse_s[i];
  }
  for (int i = 0; i < 3; ++i) {
    const int k = i == 2 ? 0 : i + 1;
    const Wide sum = s[i] + s[k], difference = s[i] - s[k], inverse_sum = reciprocal(sum);
    const WideBits close = absolute(difference) < 1e-4 * sum;
    const Wide limit = (0.5 * (f.second[i] + f.second[k]) - f.mixed[i] - 0.5 * (f.first[i] + f.first[k])) * 4 *
                       inverse_sum * inverse_sum;
    Wide flip = close ? limit : (g[i] - g[k]) * reciprocal(close ? wide(1) : difference);
    Wide twist = (g[i] + g[k]) * inverse_sum;
    flip = flip > floor ? flip : floor;
    twist = twist > floor ? twist : floor;
    store(on * 0.5 * (flip + twist), batch.pair_same[i]);
    store(on * 0.5 * (flip - twist), batch.pair_cross[i]);
    stretch.coupled[i] = f.mixed[i] * inverse_s[i] * inverse_s[k];
  }
  if constexpr (kDistortion == Distortion::hencky) {
    for (int i = 0; i < 3; ++i) {
      const Wide& value = stretch.diagonal[i];
      store(on * (value > floor ? value : floor), batch.stretch[i]);
    }
  } else {
    clamp_symmetric(stretch, floor);
    for (int i = 0; i < 3; ++i) {
      store(on * stretch.diagonal[i], batch.stretch[i]);
      store(on * stretch.coupled[i], batch.coupling[i]);
    }
  }
}

/// Computes the energy and its derivatives from the singular values and vectors of J.
template <Distortion kDistortion, Order kOrder>
[[gnu::always_inline]] inline void evaluate_at(const Singular& singular, const WideBits& feasible,
                                               DistortionBatch& batch) {
  Wide lambda[3], log_s[3];
  const auto &v = singular.v, &jv = singular.jv;
  for (int i = 0; i < 3; ++i) {
    // Rounding may make a small singular value 0.
    lambda[i] = singular.square[i] > 1e-280 ? singular.square[i] : wide(1e-280);
    log_s[i] = 0.5 * log_positive(lambda[i]);
  }
  const LogModel f = log_model<kDistortion>(lambda, log_s);
  store(feasible ? f.value : wide(std::numeric_limits<double>::infinity()), batch.energy);
  if constexpr (kOrder != Order::energy) {
    const Wide on = feasible ? wide(1) : wide(0);
    Wide w[3];
    for (int i = 0; i < 3; ++i) w[i] = on * f.first[i] * reciprocal(lambda[i]);
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c)
        store(w[0] * jv[0][r] * v[0][c] + w[1] * jv[1][r] * v[1][c] + w[2] * jv[2][r] * v[2][c],
              batch.stress[3 * r + c]);
    if constexpr (kOrder == Order::hessian) {
      Wide inverse_s[3];
      for (int i = 0; i < 3; ++i) {
        inverse_s[i] = reciprocal_square_root(lambda[i]);
        for (int r = 0; r < 3; ++r) {
          store(jv[i][r] * inverse_s[i], batch.u[3 * r + i]);
          store(v[i][r], batch.v[3 * r + i]);
        }
      }
      store_second<kDistortion>(f, lambda, inverse_s, on, batch);
    }
  }
}

template <Distortion kDistortion, Order kOrder, int kMany>
[[gnu::always_inline]] inline void evaluate_some(DistortionBatch* batches) {
  WideBits feasible[kMany];
  Singular singular[kMany];
  for (int n = 0; n < kMany; ++n) {
    Wide j[9];
    for (int k = 0; k < 9; ++k) j[k] = load(batches[n].jacobian[k]);
    // Infeasible lanes are computed as if J were the identity, so that nothing in them can overflow or trap.
    feasible[n] = determinant(j) > 0;
    for (int k = 0; k < 9; ++k) j[k] = feasible[n] ? j[k] : wide(k % 4 == 0 ? 1.0 : 0.0);
    decompose(j, singular[n]);
  }
  for (int n = 0; n < kMany; ++n) evaluate_at<kDistortion, kOrder>(singular[n], feasible[n], batches[n]);
}

template <Distortion kDistortion, Order kOrder>
void evaluate(DistortionBatch* batches, int count) {
  int n = 0;
  for (; n + 2 <= count; n += 2) evaluate_some<kDistortion, kOrder, 2>(batches + n);
  if (n < count) evaluate_some<kDistortion, kOrder, 1>(batches + n);
}

template <Distortion kDistortion>
constexpr DistortionKernels kKernels = {evaluate<kDistortion, Order::energy>, evaluate<kDistortion, Order::gradient>,
                                        evaluate<kDistortion, Order::hessian>, kDistortion != Distortion::hencky};

}  // namespace

const DistortionKernels& kernels_of(Distortion distortion) {
  switch (distortion) {
    case Distortion::inverse_mean_ratio: return kKernels<Distortion::inverse_mean_ratio>;
    case Distortion::condition_number: return kKernels<Distortion::condition_number>;
    case Distortion::hencky: break;
  }
  return kKernels<Distortion::hencky>;
}

void hencky_energy(DistortionBatch& batch) { evaluate<Distortion::hencky, Order::energy>(&batch, 1); }

void hencky_gradient(DistortionBatch& batch) { evaluate<Distortion::hencky, Order::gradient>(&batch, 1); }

void hencky_hessian(DistortionBatch& batch) { evaluate<Distortion::hencky, Order::hessian>(&batch, 1); }

double hencky(const Mat3& jacobian, Mat3* stress) {
  DistortionBatch batch;
  for (int k = 0; k < 9; ++k)
    for (int l = 0; l < kSimdLanes; ++l) batch.jacobian[k][l] = jacobian(k / 3, k % 3);
  hencky_gradient(batch);
  if (stress)
    for (int k = 0; k < 9; ++k) (*stress)(k / 3, k % 3) = batch.stress[k][0];
  return batch.energy[0];
}

}  // namespace subvol::internal
