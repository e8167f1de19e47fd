// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/elements/element_rule.h"
#include "subvol/fit/energies/distortion.h"
#include "subvol/fit/energies/regularized_barrier.h"
#include "subvol/mesh/cell_topology.h"

#include <span>

/// Kernels of `VolumeEnergy` at one quadrature point of kSimdLanes cells; private to it.
namespace subvol::internal {

/// Computes J_q of all lanes: J = sum_a x_a g_a^T diag(1/h).
inline void jacobians(std::span<const ElementRule::Entry> entries, const double (*x)[3][kSimdLanes],
                      const double (*inverse_h)[kSimdLanes], double (*jacobian)[kSimdLanes]) {
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) {
      double sum[kSimdLanes] = {};
      for (const ElementRule::Entry& entry : entries)
#pragma omp simd
        for (int l = 0; l < kSimdLanes; ++l) sum[l] += entry.gradient[c] * x[entry.vertex][r][l];
      for (int l = 0; l < kSimdLanes; ++l) jacobian[3 * r + c][l] = sum[l] * inverse_h[c][l];
    }
}

/// m = m b, lane by lane: changes from the ideal to the reference shape.
inline void multiply_lanes(double (*m)[kSimdLanes], const double (*b)[kSimdLanes]) {
  for (int r = 0; r < 3; ++r)
#pragma omp simd
    for (int l = 0; l < kSimdLanes; ++l) {
      const double m0 = m[3 * r][l], m1 = m[3 * r + 1][l], m2 = m[3 * r + 2][l];
      for (int c = 0; c < 3; ++c) m[3 * r + c][l] = m0 * b[c][l] + m1 * b[3 + c][l] + m2 * b[6 + c][l];
    }
}

/// m = m b^T, lane by lane: changes the stress back to the ideal shape.
inline void multiply_lanes_transposed(double (*m)[kSimdLanes], const double (*b)[kSimdLanes]) {
  for (int r = 0; r < 3; ++r)
#pragma omp simd
    for (int l = 0; l < kSimdLanes; ++l) {
      const double m0 = m[3 * r][l], m1 = m[3 * r + 1][l], m2 = m[3 * r + 2][l];
      for (int c = 0; c < 3; ++c) m[3 * r + c][l] = m0 * b[3 * c][l] + m1 * b[3 * c + 1][l] + m2 * b[3 * c + 2][l];
    }
}

/// v = b v, lane by lane: changes the right singular vectors so that V^T grad N becomes V^T b^T grad N.
inline void premultiply(const double (*b)[kSimdLanes], double (*v)[kSimdLanes]) {
  for (int c = 0; c < 3; ++c)
#pragma omp simd
    for (int l = 0; l < kSimdLanes; ++l) {
      const double v0 = v[c][l], v1 = v[3 + c][l], v2 = v[6 + c][l];
      for (int r = 0; r < 3; ++r) v[3 * r + c][l] = b[3 * r][l] * v0 + b[3 * r + 1][l] * v1 + b[3 * r + 2][l] * v2;
    }
}

/// Adds K_ab = U Z_ab U^T for the active vertices of one point, a <= b: with w_a = V^T diag(1/h) grad N_a,
///   Z_ii = stretch_i w_ai w_bi + sum_{j != i} same_ij w_aj w_bj,   Z_ij = cross_ij w_aj w_bi + coupling_ij w_ai w_bj.
template <bool kCoupled>
void add_point_hessian(std::span<const ElementRule::Entry> entries, const DistortionBatch& batch,
                       const double (*inverse_h)[kSimdLanes], const double* weight, double (*k)[9][kSimdLanes]) {
  alignas(64) double w[kMaxCellVertices][3][kSimdLanes];
  for (std::size_t a = 0; a < entries.size(); ++a)
    for (int i = 0; i < 3; ++i)
#pragma omp simd
      for (int l = 0; l < kSimdLanes; ++l)
        w[a][i][l] = batch.v[i][l] * inverse_h[0][l] * entries[a].gradient[0] +
                     batch.v[3 + i][l] * inverse_h[1][l] * entries[a].gradient[1] +
                     batch.v[6 + i][l] * inverse_h[2][l] * entries[a].gradient[2];
  for (std::size_t a = 0; a < entries.size(); ++a)
    for (std::size_t b = a; b < entries.size(); ++b) {
      double(*block)[kSimdLanes] = k[entries[a].vertex * kMaxCellVertices + entries[b].vertex];
#pragma omp simd
      for (int l = 0; l < kSimdLanes; ++l) {
        const double p00 = w[a][0][l] * w[b][0][l], p11 = w[a][1][l] * w[b][1][l], p22 = w[a][2][l] * w[b][2][l];
        const double s01 = batch.pair_same[0][l], s12 = batch.pair_same[1][l], s20 = batch.pair_same[2][l];
        const double f = weight[l];
        const double z00 = f * (batch.stretch[0][l] * p00 + s01 * p11 + s20 * p22);
        const double z11 = f * (batch.stretch[1][l] * p11 + s01 * p00 + s12 * p22);
        const double z22 = f * (batch.stretch[2][l] * p22 + s20 * p00 + s12 * p11);
        const double c01 = f * batch.pair_cross[0][l], c12 = f * batch.pair_cross[1][l],
                     c20 = f * batch.pair_cross[2][l];
        double z01 = c01 * w[a][1][l] * w[b][0][l], z10 = c01 * w[a][0][l] * w[b][1][l];
        double z12 = c12 * w[a][2][l] * w[b][1][l], z21 = c12 * w[a][1][l] * w[b][2][l];
        double z20 = c20 * w[a][0][l] * w[b][2][l], z02 = c20 * w[a][2][l] * w[b][0][l];
        if constexpr (kCoupled) {
          const double k01 = f * batch.coupling[0][l], k12 = f * batch.coupling[1][l], k20 = f * batch.coupling[2][l];
          z01 += k01 * w[a][0][l] * w[b][1][l], z10 += k01 * w[a][1][l] * w[b][0][l];
          z12 += k12 * w[a][1][l] * w[b][2][l], z21 += k12 * w[a][2][l] * w[b][1][l];
          z20 += k20 * w[a][2][l] * w[b][0][l], z02 += k20 * w[a][0][l] * w[b][2][l];
        }
        const double u[9] = {batch.u[0][l], batch.u[1][l], batch.u[2][l], batch.u[3][l], batch.u[4][l],
                             batch.u[5][l], batch.u[6][l], batch.u[7][l], batch.u[8][l]};
        for (int r = 0; r < 3; ++r) {
          const double t0 = u[3 * r] * z00 + u[3 * r + 1] * z10 + u[3 * r + 2] * z20;
          const double t1 = u[3 * r] * z01 + u[3 * r + 1] * z11 + u[3 * r + 2] * z21;
          const double t2 = u[3 * r] * z02 + u[3 * r + 1] * z12 + u[3 * r + 2] * z22;
          for (int c = 0; c < 3; ++c) block[3 * r + c][l] += t0 * u[3 * c] + t1 * u[3 * c + 1] + t2 * u[3 * c + 2];
        }
      }
    }
}

/// Adds the stress at one point to the gradients of its active vertices.
inline void add_point_gradient(std::span<const ElementRule::Entry> entries, const double (*stress)[kSimdLanes],
                               const double (*factor)[kSimdLanes], double (*g)[3][kSimdLanes]) {
  for (const ElementRule::Entry& entry : entries)
    for (int r = 0; r < 3; ++r)
#pragma omp simd
      for (int l = 0; l < kSimdLanes; ++l)
        g[entry.vertex][r][l] += factor[0][l] * stress[3 * r][l] * entry.gradient[0] +
                                 factor[1][l] * stress[3 * r + 1][l] * entry.gradient[1] +
                                 factor[2][l] * stress[3 * r + 2][l] * entry.gradient[2];
}

/// Evaluates one of the distortions at kDistortionPointsAtOnce points.
struct DistortionKernel {
  using Batch = DistortionBatch;
  Batch batches[kDistortionPointsAtOnce];
  const DistortionKernels& kernels;

  DistortionKernel(double /*regularization*/, const DistortionKernels& chosen, double floor) : kernels(chosen) {
    for (Batch& batch : batches) batch.floor = floor;
  }
  void evaluate_energy(int count) { kernels.energy(batches, count); }
  void evaluate_gradient(int count) { kernels.gradient(batches, count); }
  void evaluate_hessian(int count) { kernels.hessian(batches, count); }
  void add_hessian(Batch& batch, std::span<const ElementRule::Entry> entries, const double (*reference)[kSimdLanes],
                   const double (*inverse_h)[kSimdLanes], const double* weight, double (*k)[9][kSimdLanes]) {
    if (reference) premultiply(reference, batch.v);
    kernels.coupled ? add_point_hessian<true>(entries, batch, inverse_h, weight, k)
                    : add_point_hessian<false>(entries, batch, inverse_h, weight, k);
  }
};

/// Evaluates the regularized barrier at one point.
struct RegularizedKernel {
  static constexpr int kBarrierPointsAtOnce = 1;  // only untangling uses it, which takes little time
  using Batch = RegularizedBatch;
  Batch batches[kBarrierPointsAtOnce];
  double epsilon;

  RegularizedKernel(double regularization, const DistortionKernels&, double /*floor*/) : epsilon(regularization) {}
  void evaluate_energy(int /*count*/) { regularized_barrier(batches[0], epsilon); }
  void evaluate_gradient(int /*count*/) { regularized_barrier(batches[0], epsilon); }
  void evaluate_hessian(int /*count*/) { regularized_barrier(batches[0], epsilon); }

  /// K_ab = alpha w_a.w_b I + beta (J w_a (C w_b)^T + C w_a (J w_b)^T) + gamma C w_a (C w_b)^T for a <= b, with
  /// w_a = B^T diag(1/h) grad N_a, where B is `reference`.
  void add_hessian(Batch& batch, std::span<const ElementRule::Entry> entries, const double (*reference)[kSimdLanes],
                   const double (*inverse_h)[kSimdLanes], const double* weight, double (*k)[9][kSimdLanes]) {
    alignas(64) double w[kMaxCellVertices][3][kSimdLanes], jw[kMaxCellVertices][3][kSimdLanes],
        cw[kMaxCellVertices][3][kSimdLanes];
    for (std::size_t a = 0; a < entries.size(); ++a) {
      for (int i = 0; i < 3; ++i)
#pragma omp simd
        for (int l = 0; l < kSimdLanes; ++l) w[a][i][l] = inverse_h[i][l] * entries[a].gradient[i];
      if (reference) {
#pragma omp simd
        for (int l = 0; l < kSimdLanes; ++l) {
          const double w0 = w[a][0][l], w1 = w[a][1][l], w2 = w[a][2][l];
          for (int i = 0; i < 3; ++i)
            w[a][i][l] = reference[i][l] * w0 + reference[3 + i][l] * w1 + reference[6 + i][l] * w2;
        }
      }
      for (int r = 0; r < 3; ++r)
#pragma omp simd
        for (int l = 0; l < kSimdLanes; ++l) {
          jw[a][r][l] = batch.jacobian[3 * r][l] * w[a][0][l] + batch.jacobian[3 * r + 1][l] * w[a][1][l] +
                        batch.jacobian[3 * r + 2][l] * w[a][2][l];
          cw[a][r][l] = batch.cofactor[3 * r][l] * w[a][0][l] + batch.cofactor[3 * r + 1][l] * w[a][1][l] +
                        batch.cofactor[3 * r + 2][l] * w[a][2][l];
        }
    }
    for (std::size_t a = 0; a < entries.size(); ++a)
      for (std::size_t b = a; b < entries.size(); ++b) {
        double(*block)[kSimdLanes] = k[entries[a].vertex * kMaxCellVertices + entries[b].vertex];
#pragma omp simd
        for (int l = 0; l < kSimdLanes; ++l) {
          const double f = weight[l], beta = f * batch.beta[l], gamma = f * batch.gamma[l];
          const double alpha =
              f * batch.alpha[l] * (w[a][0][l] * w[b][0][l] + w[a][1][l] * w[b][1][l] + w[a][2][l] * w[b][2][l]);
          for (int r = 0; r < 3; ++r) {
            const double by_c = beta * jw[a][r][l] + gamma * cw[a][r][l], by_j = beta * cw[a][r][l];
            for (int c = 0; c < 3; ++c) block[3 * r + c][l] += by_c * cw[b][c][l] + by_j * jw[b][c][l];
            block[4 * r][l] += alpha;
          }
        }
      }
  }
};

}  // namespace subvol::internal
