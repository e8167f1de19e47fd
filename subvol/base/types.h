// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <Eigen/Core>

#include <cstdint>
#include <limits>

namespace subvol {

/// Vertex, edge, face and cell numbers. 32 bits: meshes of up to 2^31 - 1 entities of a kind.
using Index = std::int32_t;

/// Marks an entity that is not there (the second cell of a boundary face, say).
inline constexpr Index kNoIndex = -1;

/// Positions in the mesh's own length unit; 24 bytes, no padding, so arrays of them are flat arrays of doubles.
using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

}  // namespace subvol
