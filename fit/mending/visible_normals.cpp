// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/mending/visible_normals.h"

#include "subvol/base/error.h"
#include "subvol/base/parallel_errors.h"

#include <Eigen/Geometry>

#include <algorithm>

namespace subvol::internal {
namespace {

constexpr double kLeastVisibleCosine = 1e-6;  // to all normals; below it, rounding decides
constexpr std::size_t kFew = 64;              // number of normals up to which their cap is found directly, in any order

/// A cap of the unit sphere: all points p with axis . p >= cosine.
struct Cap {
  Vec3 axis;
  double cosine;
  bool holds(const Vec3& p) const { return axis.dot(p) >= cosine - 1e-12; }
};

Cap cap_of(const Vec3& p, const Vec3& q) {
  const Vec3 axis = (p + q).normalized();
  return {axis, axis.dot(p)};
}

Cap cap_of(const Vec3& p, const Vec3& q, const Vec3& r) {
  Vec3 axis = (q - p).cross(r - p).normalized();
  if (axis.dot(p) < 0) axis = -axis;
  return {axis, axis.dot(p)};
}

bool sees(const Vec3& direction, std::span<const Vec3> normals) {
  return std::ranges::all_of(normals, [&](const Vec3& normal) { return direction.dot(normal) > kLeastVisibleCosine; });
}

/// Finds the smallest cap as Welzl finds the smallest circle: a point outside lies on the border of the next larger
/// cap. Cubic in an unlucky order and, if no half of the sphere contains the points, in any order.
Cap smallest_cap_of_few(std::span<const Vec3> points) {
  Cap cap{points[0], 1};
  for (std::size_t i = 1; i < points.size(); ++i) {
    if (cap.holds(points[i])) continue;
    cap = {points[i], 1};
    for (std::size_t j = 0; j < i; ++j) {
      if (cap.holds(points[j])) continue;
      cap = cap_of(points[i], points[j]);
      for (std::size_t k = 0; k < j; ++k)
        if (!cap.holds(points[k])) cap = cap_of(points[i], points[j], points[k]);
    }
  }
  return cap;
}

/// Finds the smallest cap of many points as that of a few of them: the point farthest outside is added to the few until
/// their cap contains all points, which takes about a dozen rounds, or until no direction sees the few.
Cap smallest_cap(std::span<const Vec3> points) {
  if (points.size() <= kFew) return smallest_cap_of_few(points);
  std::vector<Vec3> few = {points[0]};
  for (;;) {
    Cap cap = smallest_cap_of_few(few);
    if (!sees(cap.axis, few)) return cap;
    const Vec3& out = *std::ranges::min_element(points, {}, [&](const Vec3& p) { return cap.axis.dot(p); });
    if (cap.holds(out) || std::find(few.begin(), few.end(), out) != few.end()) return cap;
    few.push_back(out);
  }
}

}  // namespace

std::optional<Vec3> most_visible_direction(std::span<const Vec3> normals) {
  if (normals.empty()) throw InputError("most_visible_direction: expected at least one normal");
  const Cap cap = smallest_cap(normals);
  return sees(cap.axis, normals) ? std::optional<Vec3>(cap.axis) : std::nullopt;
}

Vec3 corner_normal(const PolygonMesh& surface, std::size_t face, std::size_t corner) {
  const std::size_t begin = surface.face_offsets[face], size = surface.face_offsets[face + 1] - begin;
  const auto at = [&](std::size_t k) { return surface.positions[surface.face_vertices[begin + k % size]]; };
  const Vec3 next = (at(corner + 1) - at(corner)).normalized();
  const Vec3 previous = (at(corner + size - 1) - at(corner)).normalized();
  return next.cross(previous).normalized();
}

VisibleNormals visible_normals(const PolygonMesh& surface) {
  const std::size_t num_vertices = surface.positions.size();
  std::vector<Vec3> normals(surface.face_vertices.size());
  std::vector<std::vector<std::size_t>> corners(num_vertices);
  std::vector<std::size_t> face_of_corner(normals.size());
  for (std::size_t f = 0; f < surface.num_faces(); ++f)
    for (std::size_t h = surface.face_offsets[f]; h < surface.face_offsets[f + 1]; ++h) {
      normals[h] = corner_normal(surface, f, h - surface.face_offsets[f]);
      face_of_corner[h] = f;
      corners[surface.face_vertices[h]].push_back(h);
    }
  VisibleNormals result;
  result.directions.assign(num_vertices, Vec3::Zero());
  const auto look_at = [&](std::size_t v) {
    std::vector<Vec3> own, all;
    for (const std::size_t h : corners[v]) {
      const std::size_t f = face_of_corner[h], begin = surface.face_offsets[f], end = surface.face_offsets[f + 1];
      own.push_back(normals[h]);
      if (end - begin == 3)
        all.push_back(normals[h]);
      else
        all.insert(all.end(), normals.begin() + begin, normals.begin() + end);
    }
    if (std::any_of(own.begin(), own.end(), [](const Vec3& n) { return !(n.squaredNorm() > 0.5); })) return;
    std::optional<Vec3> direction = most_visible_direction(all);
    if (!direction) direction = most_visible_direction(own);
    if (direction) result.directions[v] = *direction;
  };
  ParallelErrors errors;
#pragma omp parallel for schedule(static)
  for (std::size_t v = 0; v < num_vertices; ++v) errors.guard([&] { look_at(v); });
  errors.rethrow();
  for (std::size_t v = 0; v < num_vertices; ++v)
    if (result.directions[v].isZero(0)) result.hidden.push_back(static_cast<Index>(v));
  return result;
}

}  // namespace subvol::internal
