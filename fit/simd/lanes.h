// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace subvol::internal {

/// Number of cells or Jacobians that the kernels process at once: one SIMD register of doubles, or several narrower
/// ones.
inline constexpr int kSimdLanes = 8;

}  // namespace subvol::internal
