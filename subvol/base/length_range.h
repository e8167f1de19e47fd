// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace subvol {

/// Sizes of meshes and targets: products of six lengths within, which certificates and areas have, are far from
/// overflow and underflow.
inline constexpr double kLeastLength = 1e-40, kMostLength = 1e40;

/// InputError, naming what it is of, unless kLeastLength <= extent <= kMostLength.
void require_length(double extent, const char* what);

}  // namespace subvol
