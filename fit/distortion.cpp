// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/distortion.h"

#include "fit/wide.h"

#include <cmath>
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

/// The 2x2 rotation that makes a symmetric matrix [[p, o], [o, q]] with entries of at most 1 diagonal, by the half angle:
/// cos 2t = |d| / sqrt(d^2 + b^2), d = q - p, b = 2 o.
struct Rotation {
  Wide c, s;

  SUBVOL_INLINE Rotation(const Wide& p, const Wide& q, const Wide& o) {
    const Wide d = q - p, b = 2 * o, size = absolute(d) + 1e-150;  // never 0
    const Wide inverse = reciprocal_square_root(size * size + b * b);
    const Wide c2 = 0.5 + 0.5 * size * inverse, inverse_c = reciprocal_square_root(c2);
    const Wide half = 0.5 * b * inverse * inverse_c;
    c = c2 * inverse_c;
    s = d < 0 ? -half : half;
  }
  SUBVOL_INLINE void turn(Wide* x, Wide* y) const {
    for (int k = 0; k < 3; ++k) {
      const Wide turned = c * x[k] - s * y[k];
      y[k] = s * x[k] + c * y[k];
      x[k] = turned;
    }
  }
};

/// A symmetric matrix; coupled: entries (0,1), (1,2), (2,0).
struct Symmetric {
  Wide diagonal[3], coupled[3];
};

SUBVOL_INLINE Wide determinant(const Symmetric& a) {
  const Wide *d = a.diagonal, *o = a.coupled;
  return d[0] * (d[1] * d[2] - o[1] * o[1]) - o[0] * (o[0] * d[2] - o[1] * o[2]) + o[2] * (o[0] * o[1] - d[1] * o[2]);
}

/// cos(acos(r) / 3) for r in [0, 1], the largest root c of 4 c^3 - 3 c = r: interpolated to 1.3e-8 (at the zeros of a
/// Chebyshev polynomial), then one step of Newton's method, to rounding.
SUBVOL_INLINE Wide cosine_of_third(const Wide& r) {
  const Wide c =
      0.866025416 +
      r * (0.166665043 +
           r * (-0.0480773503 +
                r * (0.0243923838 +
                     r * (-0.0142895648 + r * (0.00766430175 + r * (-0.0029228305 + r * 0.000542607712))))));
  const Wide c2 = c * c;
  return c - (c * (4 * c2 - 3) - r) * reciprocal(12 * c2 - 3);
}

/// The eigenvector of a symmetric matrix whose eigenvalue is the farthest from both others, of length 1. Entries are at
/// most 1; where they are all but those of a multiple of the identity, any vector.
///
/// With q = tr A / 3, 6 p^2 = |A - q I|^2, C = (A - q I)/p: C has the eigenvalues 2 cos(t + 2 pi k/3), cos 3t = r =
/// det C / 2. With the sign that makes r >= 0 the first of them is apart from the others by p sqrt 3 at least, so that
/// it is well-conditioned, and the adjugate of C - 2 cos t I is v v^T times 6 to 9.
SUBVOL_INLINE void isolated_eigenvector(const Symmetric& a, Wide* vector) {
  constexpr double kLeast = 1e-60;
  Symmetric m = a;
  const Wide mean = (1.0 / 3) * (a.diagonal[0] + a.diagonal[1] + a.diagonal[2]);
  Wide square = Wide{}, mixed = Wide{};
  for (int i = 0; i < 3; ++i) {
    m.diagonal[i] -= mean;
    square += m.diagonal[i] * m.diagonal[i];
    mixed += m.coupled[i] * m.coupled[i];
  }
  const Wide inverse = reciprocal_square_root((1.0 / 6) * square + (1.0 / 3) * mixed + kLeast);
  const Wide r = 0.5 * determinant(m) * (inverse * inverse * inverse);
  const Wide scale = r < 0 ? -inverse : inverse, eigenvalue = 2 * cosine_of_third(absolute(r));
  for (int i = 0; i < 3; ++i) {
    m.diagonal[i] = m.diagonal[i] * scale - eigenvalue;
    m.coupled[i] *= scale;
  }
  Symmetric adjugate;
  for (int i = 0; i < 3; ++i) {
    const int j = i == 2 ? 0 : i + 1, k = i == 0 ? 2 : i - 1;
    adjugate.diagonal[i] = m.diagonal[j] * m.diagonal[k] - m.coupled[j] * m.coupled[j];
    adjugate.coupled[i] = m.coupled[j] * m.coupled[k] - m.coupled[i] * m.diagonal[k];
  }
  // Its column with the largest entry on the diagonal.
  const Wide *d = adjugate.diagonal, *o = adjugate.coupled;
  const auto second = d[1] > d[0];
  const Wide larger = second ? d[1] : d[0];
  const auto third = d[2] > larger;
  vector[0] = third ? o[2] : second ? o[0] : d[0];
  vector[1] = third ? o[1] : second ? d[1] : o[0];
  vector[2] = third ? d[2] : second ? o[1] : o[2];
  const Wide normalise =
      reciprocal_square_root(vector[0] * vector[0] + vector[1] * vector[1] + vector[2] * vector[2]);
  for (int k = 0; k < 3; ++k) vector[k] *= normalise;
}

/// Two vectors that make an orthonormal basis with n, |n| = 1.                  Duff et al., JCGT 6(1), 2017
SUBVOL_INLINE void complete_basis(const Wide* n, Wide* u, Wide* v) {
  const Wide sign = n[2] < 0 ? wide(-1) : wide(1), a = -reciprocal(sign + n[2]), b = n[0] * n[1] * a;
  u[0] = 1 + sign * n[0] * n[0] * a;
  u[1] = sign * b;
  u[2] = -sign * n[0];
  v[0] = b;
  v[1] = sign + n[1] * n[1] * a;
  v[2] = -n[1];
}

SUBVOL_INLINE Wide dot(const Wide* a, const Wide* b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/// J^T J by its trace.
SUBVOL_INLINE Symmetric right_gram(const Wide* j, Wide& inverse_trace) {
  Symmetric a;
  for (int i = 0; i < 3; ++i) {
    const int k = i == 2 ? 0 : i + 1;
    a.diagonal[i] = j[i] * j[i] + j[3 + i] * j[3 + i] + j[6 + i] * j[6 + i];
    a.coupled[i] = j[i] * j[k] + j[3 + i] * j[3 + k] + j[6 + i] * j[6 + k];
  }
  inverse_trace = reciprocal(a.diagonal[0] + a.diagonal[1] + a.diagonal[2]);
  for (int i = 0; i < 3; ++i) a.diagonal[i] *= inverse_trace, a.coupled[i] *= inverse_trace;
  return a;
}

/// Right singular vectors v_i of J, J v_i, and the squares of the singular values.
struct Singular {
  Wide v[3][3], jv[3][3], square[3];
};

/// One v_i is the eigenvector of J^T J that stands apart; the others are found from J's action across it, not from
/// J^T J: small singular values are as accurate as J.
SUBVOL_INLINE void decompose(const Wide* j, Singular& result) {
  Wide inverse_trace;
  auto& [v, jv, square] = result;
  isolated_eigenvector(right_gram(j, inverse_trace), v[0]);
  complete_basis(v[0], v[1], v[2]);
  for (int i = 0; i < 3; ++i)
    for (int r = 0; r < 3; ++r) jv[i][r] = dot(j + 3 * r, v[i]);
  const Rotation rotation(inverse_trace * dot(jv[1], jv[1]), inverse_trace * dot(jv[2], jv[2]),
                          inverse_trace * dot(jv[1], jv[2]));
  rotation.turn(v[1], v[2]);
  rotation.turn(jv[1], jv[2]);
  for (int i = 0; i < 3; ++i) square[i] = dot(jv[i], jv[i]);
}

/// Raises the eigenvalues of a symmetric matrix to the floor.
SUBVOL_INLINE void clamp_symmetric(Symmetric& a, const Wide& floor) {
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

SUBVOL_INLINE Wide determinant(const Wide* j) {
  return j[0] * (j[4] * j[8] - j[5] * j[7]) - j[1] * (j[3] * j[8] - j[5] * j[6]) + j[2] * (j[3] * j[7] - j[4] * j[6]);
}

enum class Order { energy, gradient, hessian };

SUBVOL_INLINE Wide exponential(const Wide& x) {
  Wide result;
  for (int l = 0; l < kLanes; ++l) result[l] = std::exp(x[l]);
  return result;
}

/// A distortion f as a function of x_i = ln s_i: its value, first derivatives, second ones of one x_i, and of x_i and
/// x_j for (i, j) = (0,1), (1,2), (2,0).
struct LogModel {
  Wide value, first[3], second[3], mixed[3];
};

template <Distortion kDistortion>
SUBVOL_INLINE LogModel log_model(const Wide* lambda, const Wide* x) {
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

/// Second derivatives by singular values, clamped. e_i = f_i / s_i,  e_ij = (f_ij - delta_ij f_i) / (s_i s_j).
template <Distortion kDistortion>
SUBVOL_INLINE void store_second(const LogModel& f, const Wide* lambda, const Wide* inverse_s, const Wide& on,
                                DistortionBatch& batch) {
  const Wide floor = wide(batch.floor);
  Wide s[3], g[3];
  Symmetric stretch;  // coupled: how those couple
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

/// Energy and derivatives from the singular values and vectors of J.
template <Distortion kDistortion, Order kOrder>
SUBVOL_INLINE void evaluate_at(const Singular& singular, const WideBits& feasible, DistortionBatch& batch) {
  Wide lambda[3], log_s[3];
  const auto &v = singular.v, &jv = singular.jv;
  for (int i = 0; i < 3; ++i) {
    // Rounding may leave nothing of a small singular value.
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
SUBVOL_INLINE void evaluate_some(DistortionBatch* batches) {
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

const char* to_string(Distortion distortion) {
  switch (distortion) {
    case Distortion::hencky: return "hencky";
    case Distortion::inverse_mean_ratio: return "inverse_mean_ratio";
    case Distortion::condition_number: return "condition_number";
  }
  return "unknown";
}

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
    for (int l = 0; l < kLanes; ++l) batch.jacobian[k][l] = jacobian(k / 3, k % 3);
  hencky_gradient(batch);
  if (stress)
    for (int k = 0; k < 9; ++k) (*stress)(k / 3, k % 3) = batch.stress[k][0];
  return batch.energy[0];
}

}  // namespace subvol
