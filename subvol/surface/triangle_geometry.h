// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface/triangle_mesh.h"

#include <Eigen/Geometry>

#include <cmath>
#include <numbers>

namespace subvol::internal {

/// Returns an angle in [0, 180]; 0 if a vector vanishes. Uses atan2: acos would lose half the digits near 0 and 180.
inline double angle_degrees_between(const Vec3& a, const Vec3& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) * 180 / std::numbers::pi;
}

/// Returns the cross product of two sides of a triangle: twice its area long, along its normal.
inline Vec3 doubled_area_vector(const TriangleMesh& mesh, const std::array<Index, 3>& triangle) {
  const auto& [a, b, c] = triangle;
  return (mesh.positions[b] - mesh.positions[a]).cross(mesh.positions[c] - mesh.positions[a]);
}

/// Returns the unit normal of a triangle, or the vector as it is if the triangle has no area.
inline Vec3 unit_normal(const TriangleMesh& mesh, Index triangle) {
  return doubled_area_vector(mesh, mesh.triangles[triangle]).normalized();
}

}  // namespace subvol::internal
