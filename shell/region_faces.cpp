// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/shell/region_faces.h"

#include "subvol/surface/boundary.h"
#include "subvol/surface/welded_surface.h"

#include <algorithm>
#include <array>
#include <map>
#include <span>
#include <utility>

namespace subvol::internal {

namespace {

using Point = std::array<double, 3>;
using Corners = std::array<Point, 3>;

/// A position without negative zeros.
Point point_of(const Vec3& p) { return {p.x() + 0.0, p.y() + 0.0, p.z() + 0.0}; }

/// The positions of a triangle's corners, so that the same triangle is found among others by its place.
Corners corners_of(const TriangleMesh& mesh, std::size_t triangle) {
  Corners corners;
  for (std::size_t i = 0; i < 3; ++i) corners[i] = point_of(mesh.positions[mesh.triangles[triangle][i]]);
  return corners;
}

/// Sorts the corners. Returns true if that turns the triangle over.
bool sort_corners(Corners& corners) {
  bool is_turned = false;
  const auto order = [&](std::size_t i, std::size_t j) {
    if (corners[j] < corners[i]) std::swap(corners[i], corners[j]), is_turned = !is_turned;
  };
  order(0, 1);
  order(1, 2);
  order(0, 1);
  return is_turned;
}

/// A triangle of the regions, found by its place.
struct Found {
  std::size_t triangle;
  bool is_turned;  ///< by the sorting of its corners
  bool is_taken = false;
};

/// Joins vertices at one position if they lie on open edges of the faces that are left.
void close_rims(RegionFaces& faces) {
  PolygonMesh& surface = faces.surface;
  std::map<std::array<Index, 2>, std::size_t> num_faces;  // by edge
  const auto for_each_corner = [&](const auto& visit) {
    for (std::size_t f = 0; f < surface.num_faces(); ++f)
      for (std::size_t h = surface.face_offsets[f]; !faces.is_left_out[f] && h < surface.face_offsets[f + 1]; ++h)
        visit(surface.face_vertices[h],
              surface.face_vertices[h + 1 < surface.face_offsets[f + 1] ? h + 1 : surface.face_offsets[f]]);
  };
  for_each_corner([&](Index a, Index b) { ++num_faces[{std::min(a, b), std::max(a, b)}]; });
  std::map<Point, Index> first;
  std::map<Index, Index> joined;
  for (const auto& [edge, count] : num_faces)
    if (count == 1)
      for (const Index v : edge) joined[v] = first.try_emplace(point_of(surface.positions[v]), v).first->second;
  if (joined.empty()) return;
  for_each_corner([&](Index& v, Index) {
    if (const auto at = joined.find(v); at != joined.end()) v = at->second;
  });
}

}  // namespace

RegionFaces faces_of_region(const PolygonMesh& surface, const RegionSurface& regions, int region) {
  std::map<Corners, Found> by_place;
  for (std::size_t t = 0; t < regions.mesh.triangles.size(); ++t) {
    Corners corners = corners_of(regions.mesh, t);
    const bool is_turned = sort_corners(corners);
    by_place.try_emplace(corners, Found{t, is_turned});
  }
  RegionFaces result{surface, std::vector<char>(surface.num_faces(), 1), 0};
  std::vector<Index> face_of_triangle;
  const TriangleMesh triangles = triangulate(surface, &face_of_triangle);
  std::vector<char> is_seen(surface.num_faces(), 0);
  for (std::size_t t = 0; t < triangles.triangles.size(); ++t) {
    const Index face = face_of_triangle[t];
    Corners corners = corners_of(triangles, t);
    const bool is_turned = sort_corners(corners);
    const auto at = by_place.find(corners);
    if (at == by_place.end()) continue;
    Found& found = at->second;
    const bool is_taken = std::exchange(found.is_taken, true);
    if (std::exchange(is_seen[face], 1)) continue;  // the first triangle with an area decides
    const auto& [behind, front] = regions.sides[found.triangle];
    const bool bounds = region == kOutsideRegion ? front == kOutsideRegion : behind == region || front == region;
    if (!bounds || is_taken) continue;
    result.is_left_out[face] = 0;
    const bool is_outward = region == kOutsideRegion || behind == region;  // the triangle of the regions
    if (is_outward == (is_turned == found.is_turned)) continue;
    const auto first = result.surface.face_vertices.begin();
    std::reverse(first + static_cast<std::ptrdiff_t>(surface.face_offsets[face]) + 1,
                 first + static_cast<std::ptrdiff_t>(surface.face_offsets[face + 1]));
  }
  close_rims(result);
  result.num_left_out = static_cast<std::size_t>(std::ranges::count(result.is_left_out, 1));
  return result;
}

bool has_inner_sheets(const PolygonMesh& surface) {
  const TriangleMesh mesh = welded(triangulate(surface)).mesh;
  bool found = false;
  for_each_edge(sorted_half_edges(mesh.triangles, mesh.positions.size()),
                [&](std::span<const SurfaceHalfEdge> edge) { found |= edge.size() > 2; });
  return found;
}

}  // namespace subvol::internal
