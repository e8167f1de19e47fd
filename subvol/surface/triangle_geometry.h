// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface/triangle_mesh.h"

#include <Eigen/Geometry>

#include <array>
#include <cstddef>
#include <span>

namespace subvol::internal {

/// Share of the area of a closed surface, to the power of 3/2, up to which its volume may be rounding.
inline constexpr double kRoundingVolumeShare = 1e-9;

/// Returns the cross product of two sides of a triangle: twice its area long, along its normal.
inline Vec3 doubled_area_vector(const TriangleMesh& mesh, const std::array<Index, 3>& triangle) {
  const auto& [a, b, c] = triangle;
  return (mesh.positions[b] - mesh.positions[a]).cross(mesh.positions[c] - mesh.positions[a]);
}

/// Returns the sum of these vectors over a fan of triangles from the first corner of a polygon: twice its area vector.
inline Vec3 doubled_area_vector(std::span<const Vec3> positions, std::span<const Index> polygon) {
  const Vec3& first = positions[polygon[0]];
  Vec3 sum = Vec3::Zero();
  for (std::size_t k = 1; k + 1 < polygon.size(); ++k)
    sum += (positions[polygon[k]] - first).cross(positions[polygon[k + 1]] - first);
  return sum;
}

inline double triangle_area(const TriangleMesh& mesh, const std::array<Index, 3>& triangle) {
  return doubled_area_vector(mesh, triangle).norm() / 2;
}

/// Returns the unit normal of a triangle, or that of the mean plane of a quad; zero if it has no area.
inline Vec3 normal_of_face(std::span<const Vec3> positions, std::span<const Index> face) {
  const auto p = [&](std::size_t i) -> const Vec3& { return positions[face[i]]; };
  return (face.size() == 4 ? (p(2) - p(0)).cross(p(3) - p(1)) : (p(1) - p(0)).cross(p(2) - p(0))).normalized();
}

/// Returns six times the volume between a triangle and a point, negative if the point is on the side of its normal.
inline double sixfold_volume(std::span<const Vec3> positions, const std::array<Index, 3>& triangle, const Vec3& apex) {
  const auto& [a, b, c] = triangle;
  return (positions[a] - apex).dot((positions[b] - apex).cross(positions[c] - apex));
}

/// Returns the unit normal of a triangle, or the vector as it is if the triangle has no area.
inline Vec3 triangle_normal(const TriangleMesh& mesh, Index triangle) {
  return doubled_area_vector(mesh, mesh.triangles[triangle]).normalized();
}

}  // namespace subvol::internal
