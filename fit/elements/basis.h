// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace subvol {

/// Families of one-dimensional modes phi_1, phi_2, .. on [0, 1], all zero at both ends.
///
///   fourier    phi_i(x) = sqrt2 sin(i pi x) / (i pi),   phi_i'(x) = sqrt2 cos(i pi x)            Paper: section 3.2
///   legendre   phi_i'(x) = sqrt(2i + 1) P_i(1 - 2x), P_i the Legendre polynomial: phi_i has degree i + 1
///
/// Both are normalized alike: the phi_i' are orthonormal on [0, 1], every phi_i has a positive slope at 0, and
/// phi_i(1 - x) = (-1)^(i+1) phi_i(x).
enum class Basis { fourier, legendre };

/// Orders range from 1 (vertices only) to this; order p has the modes phi_1 .. phi_{p-1}.
inline constexpr int kMaxOrder = 16;

/// Returns +1 if phi_i is symmetric about 1/2 (i odd), -1 if it is antisymmetric.
inline constexpr int mode_parity(int i) { return i % 2 ? 1 : -1; }

/// Computes the p + 1 functions N_0 = 1 - x, N_1 = x, N_{i+1} = phi_i and their derivatives at x in [0, 1].
///
/// order   1 .. kMaxOrder (asserted); values, derivatives: order + 1 entries each.
/// Modes are exactly 0 at both ends. N(1 - x) equals N(x) up to order and signs, bit by bit if 1 - x is exact.
void line_functions(Basis basis, int order, double x, double* values, double* derivatives);

/// Computes the modes without their zeros at the ends: psi_i(x) = phi_i(x) / (x (1 - x)), i = 1 .. order - 1, smooth.
///
/// For Legendre, psi_i is a polynomial of degree i - 1. Its parity is that of phi_i. It is computed without dividing by
/// small numbers. values, derivatives: order - 1 entries each.
void mode_kernels(Basis basis, int order, double x, double* values, double* derivatives);

/// Returns "fourier" or "legendre".
const char* to_string(Basis basis);

}  // namespace subvol
