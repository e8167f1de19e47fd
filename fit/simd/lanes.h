// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace subvol {

/// How many cells, or Jacobians, the kernels work on at once: one SIMD register of doubles, or several narrow ones.
inline constexpr int kLanes = 8;

}  // namespace subvol
