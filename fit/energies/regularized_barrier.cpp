// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/energies/regularized_barrier.h"

#include "subvol/fit/energies/singular_values.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace subvol::internal {

namespace {

/// Weights of the terms of shape and of size.
constexpr double kShapeWeight = 0.25, kSizeWeight = 1.0 / 6;

/// (D + sqrt(eps^2 + D^2)) / 2 without cancellation.
double chi_of(double determinant, double root, double epsilon) {
  return determinant > 0 ? 0.5 * (determinant + root) : 0.5 * epsilon * (epsilon / (root - determinant));
}

/// J = U diag(s) V^T with rotations U and V; s[2] may be negative.
struct SignedSingularValues {
  Mat3 u, v;
  Vec3 s;
};

/// Completes the decomposition in one lane. The two larger singular values give two columns of U, and these the third:
/// it could not be found from a value near 0.
SignedSingularValues signed_values(const Singular& singular, int lane) {
  Mat3 v, jv;
  for (int i = 0; i < 3; ++i)
    for (int r = 0; r < 3; ++r) {
      v(r, i) = singular.v[i][r][lane];
      jv(r, i) = singular.jv[i][r][lane];
    }
  std::array<int, 3> order{0, 1, 2};
  std::ranges::sort(order, [&](int a, int b) { return singular.square[a][lane] > singular.square[b][lane]; });
  SignedSingularValues result;
  for (int i = 0; i < 2; ++i) result.v.col(i) = v.col(order[i]);
  result.v.col(2) = result.v.col(0).cross(result.v.col(1));
  const Vec3 first = jv.col(order[0]), second = jv.col(order[1]);
  constexpr double kLeastSingularValue = 1e-140;  // smaller ones are 0: their squares vanish in double precision
  result.s[0] = first.norm();
  result.u.col(0) = result.s[0] > kLeastSingularValue ? Vec3(first / result.s[0]) : Vec3(Vec3::UnitX());
  const Vec3 across = second - result.u.col(0).dot(second) * result.u.col(0);
  result.s[1] = across.norm();
  result.u.col(1) =
      result.s[1] > kLeastSingularValue ? Vec3(across / result.s[1]) : Vec3(result.u.col(0).unitOrthogonal());
  result.u.col(2) = result.u.col(0).cross(result.u.col(1));
  const double sign = result.v.col(2).dot(v.col(order[2])) < 0 ? -1 : 1;
  result.s[2] = sign * result.u.col(2).dot(jv.col(order[2]));
  return result;
}

/// Evaluates the barrier for a batch of another form, and copies its value and first derivative there.
RegularizedBatch evaluated(DistortionBatch& batch, double epsilon) {
  RegularizedBatch barrier;
  for (int k = 0; k < 9; ++k) std::copy_n(batch.jacobian[k], kSimdLanes, barrier.jacobian[k]);
  regularized_barrier(barrier, epsilon);
  std::copy_n(barrier.energy, kSimdLanes, batch.energy);
  for (int k = 0; k < 9; ++k) std::copy_n(barrier.stress[k], kSimdLanes, batch.stress[k]);
  return barrier;
}

void fill_second(const RegularizedBatch& barrier, DistortionBatch& batch) {
  constexpr double kLeastSquare = 1e-200;  // of |J|^2; a smaller J is replaced by a tiny multiple of the identity
  Wide j[9];
  for (int k = 0; k < 9; ++k) j[k] = load_wide(batch.jacobian[k]);
  Wide square{};
  for (const Wide& entry : j) square += entry * entry;
  for (int k = 0; k < 9; ++k) j[k] = square > kLeastSquare ? j[k] : wide(k % 4 == 0 ? 1e-90 : 0.0);
  Singular singular;
  decompose(j, singular);
  for (int l = 0; l < kSimdLanes; ++l) {
    const auto [u, v, s] = signed_values(singular, l);
    const Vec3 c(s[1] * s[2], s[2] * s[0], s[0] * s[1]);
    const double alpha = barrier.alpha[l], beta = barrier.beta[l], gamma = barrier.gamma[l];
    for (int i = 0; i < 3; ++i) {
      const int k = (i + 1) % 3;
      for (int r = 0; r < 3; ++r) {
        batch.u[3 * r + i][l] = u(r, i);
        batch.v[3 * r + i][l] = v(r, i);
      }
      batch.stretch[i][l] = alpha + 2 * beta * s[i] * c[i] + gamma * c[i] * c[i];
      batch.coupling[i][l] = beta * (s[i] * c[k] + s[k] * c[i]) + gamma * c[i] * c[k];
      batch.pair_same[i][l] = alpha;
      batch.pair_cross[i][l] = 0;
    }
  }
}

}  // namespace

void regularized_gradient(DistortionBatch* batches, int count, double epsilon) {
  for (int n = 0; n < count; ++n) evaluated(batches[n], epsilon);
}

void regularized_hessian(DistortionBatch* batches, int count, double epsilon) {
  for (int n = 0; n < count; ++n) fill_second(evaluated(batches[n], epsilon), batches[n]);
}

void regularized_barrier(RegularizedBatch& batch, double epsilon) {
  const double(&j)[9][kSimdLanes] = batch.jacobian;
  alignas(64) double power[kSimdLanes], chi[kSimdLanes], slope[kSimdLanes], determinant[kSimdLanes],
      squared[kSimdLanes];
#pragma omp simd
  for (int l = 0; l < kSimdLanes; ++l) {
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) {
        const int r1 = (r + 1) % 3, r2 = (r + 2) % 3, c1 = (c + 1) % 3, c2 = (c + 2) % 3;
        batch.cofactor[3 * r + c][l] = j[3 * r1 + c1][l] * j[3 * r2 + c2][l] - j[3 * r1 + c2][l] * j[3 * r2 + c1][l];
      }
    determinant[l] = j[0][l] * batch.cofactor[0][l] + j[1][l] * batch.cofactor[1][l] + j[2][l] * batch.cofactor[2][l];
    double sum = 0;
    for (int k = 0; k < 9; ++k) sum += j[k][l] * j[k][l];
    squared[l] = sum;
  }
  for (int l = 0; l < kSimdLanes; ++l) {
    const double root = std::hypot(epsilon, determinant[l]);
    // Far on the inverted side chi underflows; the energy is huge there with this bound, too.
    chi[l] = std::max(chi_of(determinant[l], root, epsilon), 1e-60);
    slope[l] = chi[l] / root;
    const double cube_root = std::cbrt(chi[l]);
    power[l] = 1 / (cube_root * cube_root);
  }
#pragma omp simd
  for (int l = 0; l < kSimdLanes; ++l) {
    const double d = determinant[l], inverse = 1 / chi[l], relative = slope[l] * inverse;  // d ln chi / dD
    const double shape = kShapeWeight * squared[l] * power[l], size = kSizeWeight * (d * d + 1) * inverse;
    batch.energy[l] = shape + size;
    const double size_slope = 2 * kSizeWeight * d * inverse;
    const double by_determinant = -(2.0 / 3) * shape * relative + size_slope - size * relative;
    batch.alpha[l] = 2 * kShapeWeight * power[l];
    batch.beta[l] = -(2.0 / 3) * batch.alpha[l] * relative;
    batch.gamma[l] = (10.0 / 9) * shape * relative * relative + 2 * kSizeWeight * inverse - 2 * size_slope * relative +
                     2 * size * relative * relative;
    for (int k = 0; k < 9; ++k) batch.stress[k][l] = batch.alpha[l] * j[k][l] + by_determinant * batch.cofactor[k][l];
  }
}

}  // namespace subvol::internal
