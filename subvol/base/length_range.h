// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace subvol::internal {

/// Range of the sizes of meshes and targets. Within it, products of six lengths, as certificates and areas have them,
/// are far from overflow and underflow.
inline constexpr double kLeastSupportedLength = 1e-40, kMostSupportedLength = 1e40;

/// Throws InputError, naming `what`, unless kLeastSupportedLength <= extent <= kMostSupportedLength.
void require_length(double extent, const char* what);

}  // namespace subvol::internal
