// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"
#include "subvol/fit/energies/distortion_kind.h"
#include "subvol/fit/simd/lanes.h"

namespace subvol::internal {

/// Default floor to which the eigenvalues of a distortion's second derivative are raised (dimensionless).
inline constexpr double kHessianFloor = 0.01;
/// Batches that are worth passing to a kernel at once: the rotation of one need not wait for that of the other.
inline constexpr int kDistortionPointsAtOnce = 2;

/// Distortion energies of kSimdLanes Jacobians, lane by lane, with their derivatives.
///
///   e(J) = 1/2 |H|^2,  H = 1/2 ln(J^T J),  de/dJ = J^-T H                      Paper: section 3.1, appendix A
///
/// With J = U diag(s) V^T: e = 1/2 sum (ln s_i)^2, de/dJ = U diag(ln s_i / s_i) V^T, and the second derivative has the
/// eigenvectors u_i v_i^T (stretch) and (u_i v_j^T -+ u_j v_i^T)/sqrt 2 (twist, flip) with the eigenvalues
///
///   stretch_i = (1 - ln s_i)/s_i^2,  twist_ij = (g_i + g_j)/(s_i + s_j),  flip_ij = (g_i - g_j)/(s_i - s_j),
///   g_i = ln s_i / s_i;
///
/// each is raised to at least the floor, so that the Hessian is positive definite. For the other distortions
/// g_i = de/ds_i, and the stretches are coupled: their matrix d2e/ds_i ds_j is clamped as a whole, by its eigenvalues.
///
/// If det J <= 0 (infeasible), the energy is +infinity and the derivatives are zero. Never NaN for finite J.
struct DistortionBatch {
  /// In: J row by row; rows are world x, y, z, columns reference directions.
  alignas(64) double jacobian[9][kSimdLanes];
  alignas(64) double energy[kSimdLanes];         ///< e(J), dimensionless, >= 0
  alignas(64) double stress[9][kSimdLanes];      ///< de/dJ, laid out like J
  alignas(64) double u[9][kSimdLanes];           ///< left singular vectors (columns)
  alignas(64) double v[9][kSimdLanes];           ///< right singular vectors (columns)
  alignas(64) double stretch[3][kSimdLanes];     ///< clamped stretch_i
  alignas(64) double pair_same[3][kSimdLanes];   ///< (flip + twist)/2 for (0,1), (1,2), (2,0): weight of (u_i v_j^T)^2
  alignas(64) double pair_cross[3][kSimdLanes];  ///< (flip - twist)/2: weight of u_i v_j^T times u_j v_i^T
  /// Clamped coupling of u_i v_i^T and u_j v_j^T for (0,1), (1,2), (2,0). Not written for Hencky, which has none.
  alignas(64) double coupling[3][kSimdLanes];
  double floor = kHessianFloor;  ///< in: floor of the eigenvalues of the second derivative; -infinity: none
};

/// The kernels of one distortion. Each also fills what the ones before it fill. Several batches are worked on in pairs,
/// side by side, which is faster than one after the other; the results agree up to rounding.
struct DistortionKernels {
  void (*energy)(DistortionBatch* batches, int count);    ///< `energy`
  void (*gradient)(DistortionBatch* batches, int count);  ///< also `stress`
  void (*hessian)(DistortionBatch* batches, int count);   ///< everything
  bool coupled;                                           ///< true if stretches are coupled
};
const DistortionKernels& kernels_of(Distortion distortion);

/// Hencky distortion. Fills `energy`. Cost: the singular values of one 3x3 matrix per lane.
void hencky_energy(DistortionBatch& batch);
/// Hencky distortion. Fills `energy` and `stress`.
void hencky_gradient(DistortionBatch& batch);
/// Hencky distortion. Fills everything.
void hencky_hessian(DistortionBatch& batch);

/// Returns the Hencky distortion e(J) of one Jacobian, +infinity if det J <= 0; `stress` (may be null) receives de/dJ.
double hencky(const Mat3& jacobian, Mat3* stress = nullptr);

}  // namespace subvol::internal
