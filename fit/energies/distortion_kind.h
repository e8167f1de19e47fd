// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace subvol {

/// Measures of a cell's distortion at a point: functions of the singular values s of the Jacobian J, 0 if it is ideal.
///
///   hencky               1/2 sum (ln s_i)^2          rigid: 0 for rotations; keeps sizes      Paper: section 3.1
///   inverse_mean_ratio   |J|^2 / (3 det^(2/3)) - 1   conformal: 0 for similarities            Paper: figure 2
///   condition_number     |J| |J^-1| / 3 - 1          conformal; grows faster toward inversion
///
/// Norms are Frobenius norms. With x_i = ln s_i the last two agree to second order: 2/3 sum (x_i - mean x)^2.
enum class Distortion { hencky, inverse_mean_ratio, condition_number };
/// Returns the name above.
const char* to_string(Distortion distortion);

}  // namespace subvol
