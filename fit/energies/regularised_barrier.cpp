// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/energies/regularised_barrier.h"

#include <algorithm>
#include <cmath>

namespace subvol::internal {

namespace {

constexpr double kShapeWeight = 0.25, kSizeWeight = 1.0 / 6;

/// (D + sqrt(eps^2 + D^2)) / 2 without cancellation.
double chi_of(double determinant, double root, double epsilon) {
  return determinant > 0 ? 0.5 * (determinant + root) : 0.5 * epsilon * (epsilon / (root - determinant));
}

}  // namespace

void regularised_barrier(RegularisedBatch& batch, double epsilon) {
  const double (&j)[9][kLanes] = batch.jacobian;
  alignas(64) double power[kLanes], chi[kLanes], slope[kLanes], determinant[kLanes], squared[kLanes];
#pragma omp simd
  for (int l = 0; l < kLanes; ++l) {
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
  for (int l = 0; l < kLanes; ++l) {
    const double root = std::hypot(epsilon, determinant[l]);
    // Far on the inverted side chi underflows; the energy is huge there with this bound, too.
    chi[l] = std::max(chi_of(determinant[l], root, epsilon), 1e-60);
    slope[l] = chi[l] / root;
    const double cube_root = std::cbrt(chi[l]);
    power[l] = 1 / (cube_root * cube_root);
  }
#pragma omp simd
  for (int l = 0; l < kLanes; ++l) {
    const double d = determinant[l], inverse = 1 / chi[l], relative = slope[l] * inverse;  // d ln chi / dD
    const double shape = kShapeWeight * squared[l] * power[l], size = kSizeWeight * (d * d + 1) * inverse;
    batch.energy[l] = shape + size;
    const double size_slope = 2 * kSizeWeight * d * inverse;
    const double by_determinant = -(2.0 / 3) * shape * relative + size_slope - size * relative;
    batch.alpha[l] = 2 * kShapeWeight * power[l];
    batch.beta[l] = -(2.0 / 3) * batch.alpha[l] * relative;
    batch.gamma[l] = (10.0 / 9) * shape * relative * relative + 2 * kSizeWeight * inverse -
                     2 * size_slope * relative + 2 * size * relative * relative;
    for (int k = 0; k < 9; ++k) batch.stress[k][l] = batch.alpha[l] * j[k][l] + by_determinant * batch.cofactor[k][l];
  }
}

}  // namespace subvol::internal
