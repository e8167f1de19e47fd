// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/shell/partial_surface.h"

#include "subvol/base/disjoint_sets.h"
#include "subvol/base/error.h"
#include "subvol/base/sort_unique.h"
#include "subvol/fit/geometry/closest_point.h"
#include "subvol/mesh/features.h"
#include "subvol/surface/boundary.h"
#include "subvol/surface/by_number.h"
#include "subvol/surface/triangle_geometry.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>
#include <string>
#include <tuple>
#include <utility>

namespace subvol {

using namespace internal;
namespace {

/// Divides a surface into patches: faces connected through edges of two faces that are no sharper than an angle.
/// Returns the smallest face of each face's patch.
std::vector<Index> patches(const PolygonMesh& surface, double degrees) {
  DisjointSets sets(surface.num_faces());
  struct Side {
    Index low, high, face;
    bool forward;
  };
  std::vector<Side> sides;
  std::vector<Vec3> normals;
  for (std::size_t f = 0; f < surface.num_faces(); ++f) {
    const auto corners = surface.face(f);
    normals.push_back(doubled_area_vector(surface.positions, corners).stableNormalized());
    for (std::size_t k = 0; k < corners.size(); ++k) {
      const Index from = corners[k], to = corners[(k + 1) % corners.size()];
      sides.push_back({std::min(from, to), std::max(from, to), static_cast<Index>(f), from < to});
    }
  }
  std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
    return std::tie(a.low, a.high, a.face) < std::tie(b.low, b.high, b.face);
  });
  const double least = std::cos(degrees * std::numbers::pi / 180);
  for (std::size_t first = 0, last; first < sides.size(); first = last) {
    last = first + 1;
    while (last < sides.size() && sides[last].low == sides[first].low && sides[last].high == sides[first].high) ++last;
    if (last - first != 2) continue;
    const Side &a = sides[first], &b = sides[first + 1];
    const double sign = a.forward != b.forward ? 1 : -1;  // faces may disagree about the outside
    if (sign * normals[a.face].dot(normals[b.face]) < least) continue;
    sets.join(a.face, b.face);
  }
  std::vector<Index> patch(surface.num_faces());
  for (std::size_t f = 0; f < patch.size(); ++f) patch[f] = sets.of(static_cast<Index>(f));
  return patch;
}

}  // namespace

std::vector<char> patch_of_face(const PolygonMesh& surface, Index face, double degrees) {
  if (face < 0 || static_cast<std::size_t>(face) >= surface.num_faces())
    throw InputError("the surface has no face " + std::to_string(face));
  const std::vector<Index> patch = patches(surface, degrees);
  std::vector<char> is_in(patch.size());
  for (std::size_t f = 0; f < patch.size(); ++f) is_in[f] = patch[f] == patch[face];
  return is_in;
}

Index closest_face(const PolygonMesh& surface, const Vec3& point) {
  std::vector<Index> face_of_triangle;
  const ClosestPoint tree(triangulate(surface, &face_of_triangle));
  std::array<ClosestPoint::Hit, 1> hit;
  tree.closest(std::array{point}, hit);
  return face_of_triangle[hit[0].triangle];
}

PartialSurface without_faces(const PolygonMesh& surface, const FeatureTags& tags, std::span<const char> is_left_out) {
  PartialSurface result;
  std::vector<Index> number(surface.positions.size(), kNoIndex);
  for (std::size_t f = 0; f < surface.num_faces(); ++f) {
    if (is_left_out[f]) continue;
    result.face_numbers.push_back(static_cast<Index>(f));
    for (const Index v : surface.face(f)) {
      if (number[v] == kNoIndex) {
        number[v] = static_cast<Index>(result.vertex_numbers.size());
        result.vertex_numbers.push_back(v);
        result.surface.positions.push_back(surface.positions[v]);
      }
      result.surface.face_vertices.push_back(number[v]);
    }
    result.surface.face_offsets.push_back(result.surface.face_vertices.size());
  }
  if (result.face_numbers.empty()) throw InputError("all faces are left out");
  result.surface.face_groups = groups_by_number(surface.face_groups, result.face_numbers);
  result.tags = tags_by_number(tags, result.surface, result.vertex_numbers);

  // The planes of flat patches that were left out.
  Eigen::AlignedBox3d box;
  for (const Vec3& p : surface.positions) box.extend(p);
  const double tolerance = kFlatShare * box.diagonal().norm();
  const std::vector<Index> patch = patches(surface, kPatchDegrees);
  std::map<Index, std::vector<std::size_t>> left_out;  // faces by patch
  for (std::size_t f = 0; f < patch.size(); ++f)
    if (is_left_out[f]) left_out[patch[f]].push_back(f);
  for (const auto& [name, faces] : left_out) {
    Vec3 normal = Vec3::Zero();
    for (const std::size_t f : faces) normal += doubled_area_vector(surface.positions, surface.face(f));
    if (!(normal.norm() > 0)) continue;
    normal.normalize();
    BorderPlane plane{normal, {}};
    const Vec3& origin = surface.positions[surface.face(faces[0])[0]];
    bool is_flat = true;
    for (const std::size_t f : faces)
      for (const Index v : surface.face(f)) {
        is_flat = is_flat && std::abs(normal.dot(surface.positions[v] - origin)) <= tolerance;
        if (number[v] != kNoIndex) plane.vertices.push_back(number[v]);
      }
    sort_unique(plane.vertices);
    if (is_flat && !plane.vertices.empty()) result.border_planes.push_back(std::move(plane));
  }
  return result;
}

}  // namespace subvol
