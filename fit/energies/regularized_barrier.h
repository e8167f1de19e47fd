// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"
#include "subvol/fit/energies/distortion.h"

namespace subvol::internal {

/// Distortion energy that is finite for every Jacobian, including inverted ones, and tends to a barrier as eps tends to
/// 0; kSimdLanes at once.
///
///   e_eps(J) = 1/4 |J|^2 / chi^(2/3) + 1/6 (D^2 + 1) / chi,  D = det J
///   chi(D, eps) = (D + sqrt(eps^2 + D^2)) / 2
///
/// Source: Garanzha, Kaporin, Kudryavtseva, Protais, Ray, Sokolov: Foldover-free maps in 50 lines of code (2021), with
/// other weights: without regularization (chi = D) it is 13/12 at rotations and agrees there with the Hencky energy
/// (`distortion.h`) up to second order, so that one turns into the other as cells become positive and well shaped.
///
/// The second derivative is that of the energy as a function of J and D, with chi replaced by its tangent, which is
/// convex. The curvatures of D(J) and chi(D) are left out:
///
///   H = alpha I + beta (J (x) C + C (x) J) + gamma C (x) C >= 0,  C = dD/dJ (cofactors)
///
/// Finite for finite J and eps > 0; no value is NaN.
struct RegularizedBatch {
  alignas(64) double jacobian[9][kSimdLanes];  ///< in: laid out as in `DistortionBatch`
  alignas(64) double energy[kSimdLanes];       ///< > 0
  alignas(64) double stress[9][kSimdLanes];    ///< de/dJ
  alignas(64) double cofactor[9][kSimdLanes];  ///< C
  alignas(64) double alpha[kSimdLanes], beta[kSimdLanes], gamma[kSimdLanes];
};

/// Fills everything. epsilon > 0, dimensionless.
void regularized_barrier(RegularizedBatch& batch, double epsilon);

/// These functions evaluate the barrier in the form of the other distortions, with coupled stretches. U and V are the
/// rotations of J = U diag(s) V^T, where s_2 has the sign of D. Then C = U diag(c) V^T, and so
///
///   stretch_i = alpha + 2 beta D + gamma c_i^2,  coupling_ij = beta (s_i c_j + s_j c_i) + gamma c_i c_j,
///   pair_same = alpha,  pair_cross = 0,  c_i = D / s_i
///
/// `regularized_gradient` fills `energy` and `stress`, `regularized_hessian` everything. count: number of batches.
void regularized_gradient(DistortionBatch* batches, int count, double epsilon);
void regularized_hessian(DistortionBatch* batches, int count, double epsilon);

}  // namespace subvol::internal
