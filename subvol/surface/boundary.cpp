// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/surface/boundary.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <limits>
#include <span>

namespace subvol {

namespace {

using Triangle = std::array<Index, 3>;

/// Cuts polygons of one mesh; holds its positions and the triangles made so far.
class PolygonCutter {
 public:
  PolygonCutter(const std::vector<Vec3>& positions, std::vector<Triangle>& triangles)
      : x_(positions), triangles_(triangles) {}

  void cut(std::span<const Index> polygon) {
    if (polygon.size() == 3) triangles_.push_back({polygon[0], polygon[1], polygon[2]});
    if (polygon.size() == 4) cut_quad(polygon);
    if (polygon.size() > 4) cut_ears(polygon);
  }

 private:
  Vec3 area_vector(Index a, Index b, Index c) const { return (x_[b] - x_[a]).cross(x_[c] - x_[a]); }

  bool same_side(const Triangle& s, const Triangle& t) const {
    return area_vector(s[0], s[1], s[2]).dot(area_vector(t[0], t[1], t[2])) >= 0;
  }

  void cut_quad(std::span<const Index> q) {
    std::array<Triangle, 2> cut = {{{q[0], q[1], q[2]}, {q[0], q[2], q[3]}}};
    std::array<Triangle, 2> other = {{{q[0], q[1], q[3]}, {q[1], q[2], q[3]}}};
    if ((x_[q[3]] - x_[q[1]]).squaredNorm() < (x_[q[2]] - x_[q[0]]).squaredNorm()) std::swap(cut, other);
    // In a dart (a quad with a reflex corner) the shorter diagonal may run outside.
    if (!same_side(cut[0], cut[1]) && same_side(other[0], other[1])) std::swap(cut, other);
    triangles_.insert(triangles_.end(), cut.begin(), cut.end());
  }

  void cut_ears(std::span<const Index> polygon) {
    std::vector<Index> rest(polygon.begin(), polygon.end());
    Vec3 normal = Vec3::Zero();
    for (std::size_t i = 1; i + 1 < rest.size(); ++i) normal += area_vector(rest[0], rest[i], rest[i + 1]);
    while (rest.size() > 4) {
      const std::size_t n = rest.size(), ear = best_ear(rest, normal);
      triangles_.push_back({rest[(ear + n - 1) % n], rest[ear], rest[(ear + 1) % n]});
      rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(ear));
    }
    cut_quad(rest);
  }

  /// Returns the corner with the shortest cut among those that are convex and cover no other corner; if there is none,
  /// the corner with the shortest cut of all.
  std::size_t best_ear(const std::vector<Index>& rest, const Vec3& normal) const {
    const std::size_t n = rest.size();
    std::size_t best = 0, best_poor = 0;
    double length = kInfinity, poor_length = kInfinity;
    for (std::size_t i = 0; i < n; ++i) {
      const Triangle ear = {rest[(i + n - 1) % n], rest[i], rest[(i + 1) % n]};
      const double cut = (x_[ear[2]] - x_[ear[0]]).squaredNorm();
      if (cut < poor_length) poor_length = cut, best_poor = i;
      if (cut < length && is_ear(rest, ear, normal)) length = cut, best = i;
    }
    return length < kInfinity ? best : best_poor;
  }

  bool is_ear(const std::vector<Index>& rest, const Triangle& ear, const Vec3& normal) const {
    if (area_vector(ear[0], ear[1], ear[2]).dot(normal) <= 0) return false;
    return std::none_of(rest.begin(), rest.end(), [&](Index v) {
      if (std::find(ear.begin(), ear.end(), v) != ear.end()) return false;
      return area_vector(ear[0], ear[1], v).dot(normal) >= 0 && area_vector(ear[1], ear[2], v).dot(normal) >= 0 &&
             area_vector(ear[2], ear[0], v).dot(normal) >= 0;
    });
  }

  const std::vector<Vec3>& x_;
  std::vector<Triangle>& triangles_;
};

}  // namespace

PolygonMesh boundary_surface(const VolumeMesh& mesh, const MeshTopology& topology, std::vector<Index>* volume_vertex) {
  std::vector<Index> kept, surface_vertex(mesh.num_vertices(), kNoIndex);
  for (std::size_t v = 0; v < mesh.num_vertices(); ++v) {
    if (!topology.is_boundary_vertex(static_cast<Index>(v))) continue;
    surface_vertex[v] = static_cast<Index>(kept.size());
    kept.push_back(static_cast<Index>(v));
  }

  PolygonMesh surface;
  surface.positions.reserve(kept.size());
  for (const Index v : kept) surface.positions.push_back(mesh.positions[v]);
  for (const Index f : topology.boundary_faces()) {
    for (const Index v : topology.face(f)) surface.face_vertices.push_back(surface_vertex[v]);
    surface.face_offsets.push_back(surface.face_vertices.size());
  }
  surface.face_groups = {mesh.face_groups.groups, groups_of_boundary(mesh.face_groups, topology)};
  if (volume_vertex) *volume_vertex = std::move(kept);
  return surface;
}

TriangleMesh triangulate(const PolygonMesh& polygons, std::vector<Index>* polygon_of_triangle) {
  TriangleMesh result;
  result.positions = polygons.positions;
  result.face_groups.groups = polygons.face_groups.groups;
  if (polygon_of_triangle) polygon_of_triangle->clear();
  PolygonCutter cutter(result.positions, result.triangles);
  for (std::size_t f = 0; f < polygons.num_faces(); ++f) {
    cutter.cut(polygons.face(f));
    if (polygon_of_triangle) polygon_of_triangle->resize(result.triangles.size(), static_cast<Index>(f));
    if (!polygons.face_groups.empty())
      result.face_groups.of_face.resize(result.triangles.size(), polygons.face_groups.of_face[f]);
  }
  return result;
}

PolygonMesh as_polygons(const TriangleMesh& mesh) {
  PolygonMesh polygons{.positions = mesh.positions};
  for (const auto& triangle : mesh.triangles) {
    polygons.face_vertices.insert(polygons.face_vertices.end(), triangle.begin(), triangle.end());
    polygons.face_offsets.push_back(polygons.face_vertices.size());
  }
  polygons.face_groups = mesh.face_groups;
  return polygons;
}

}  // namespace subvol
