// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"

#include <Eigen/Geometry>

#include <cmath>
#include <numbers>

namespace subvol::internal {

/// Returns an angle in [0, 180]; 0 if a vector vanishes. Uses atan2: acos would lose half the digits near 0 and 180.
inline double angle_degrees_between(const Vec3& a, const Vec3& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) * 180 / std::numbers::pi;
}

}  // namespace subvol::internal
