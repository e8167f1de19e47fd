// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/export/polygon_shading.h"

#include "subvol/base/disjoint_sets.h"
#include "subvol/base/error.h"
#include "subvol/export/text_format.h"
#include "subvol/surface/triangle_geometry.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace subvol::internal {
namespace {

struct Corner {
  std::size_t entry;  ///< index in face_vertices
  std::size_t face;
  Index before, after;  ///< the neighbors on the face
};

std::vector<std::vector<Corner>> corners_of_vertices(const PolygonMesh& mesh) {
  std::vector<std::vector<Corner>> corners(mesh.positions.size());
  for (std::size_t f = 0; f < mesh.num_faces(); ++f)
    for (std::size_t begin = mesh.face_offsets[f], end = mesh.face_offsets[f + 1], k = begin; k < end; ++k)
      corners[mesh.face_vertices[k]].push_back(
          {k, f, mesh.face_vertices[k == begin ? end - 1 : k - 1], mesh.face_vertices[k + 1 == end ? begin : k + 1]});
  return corners;
}

std::vector<Vec3> area_vectors(const PolygonMesh& mesh) {
  std::vector<Vec3> areas;
  areas.reserve(mesh.num_faces());
  for (std::size_t f = 0; f < mesh.num_faces(); ++f)
    areas.push_back(doubled_area_vector(mesh.positions, mesh.face(f)) / 2);
  return areas;
}

/// Returns the first corner of the group of each corner: groups grow over smooth edges.
std::vector<Index> smooth_groups(const std::vector<Corner>& corners, const std::vector<Vec3>& areas, double cos_angle) {
  std::vector<std::pair<Index, Index>> spokes;  // the other end of an edge at the vertex, and the corner
  for (std::size_t i = 0; i < corners.size(); ++i) {
    spokes.push_back({corners[i].before, static_cast<Index>(i)});
    spokes.push_back({corners[i].after, static_cast<Index>(i)});
  }
  std::sort(spokes.begin(), spokes.end());
  DisjointSets groups(corners.size());
  for (std::size_t s = 0; s < spokes.size(); ++s)
    for (std::size_t t = s + 1; t < spokes.size() && spokes[t].first == spokes[s].first; ++t) {
      const Index i = spokes[s].second, j = spokes[t].second;
      const Vec3 &a = areas[corners[j].face], &b = areas[corners[i].face];
      if (a.dot(b) > cos_angle * a.norm() * b.norm()) groups.join(i, j);
    }
  std::vector<Index> first;
  for (std::size_t i = 0; i < corners.size(); ++i) first.push_back(groups.of(static_cast<Index>(i)));
  return first;
}

}  // namespace

ShadedPolygons shade_polygons(const PolygonMesh& mesh, double crease_angle_degrees) {
  if (!(crease_angle_degrees >= 0 && crease_angle_degrees <= 180))
    throw InputError("shade_polygons: crease_angle_degrees: expected 0 to 180");
  require_polygons(mesh, "shade_polygons");
  const double cos_angle = std::cos(crease_angle_degrees * std::numbers::pi / 180);
  const std::vector<Vec3> areas = area_vectors(mesh);
  ShadedPolygons shaded;
  shaded.corner_vertices.resize(mesh.face_vertices.size());
  const auto corners_of = corners_of_vertices(mesh);
  for (std::size_t v = 0; v < corners_of.size(); ++v) {
    const std::vector<Corner>& corners = corners_of[v];
    const std::vector<Index> first = smooth_groups(corners, areas, cos_angle);
    for (std::size_t i = 0; i < corners.size(); ++i) {
      if (first[i] == static_cast<Index>(i)) {
        shaded.corner_vertices[corners[i].entry] = static_cast<Index>(shaded.positions.size());
        shaded.positions.push_back(mesh.positions[v]);
      } else {
        shaded.corner_vertices[corners[i].entry] = shaded.corner_vertices[corners[first[i]].entry];
      }
    }
  }
  shaded.normals = shaded_normals(mesh, shaded.corner_vertices, shaded.positions.size());
  return shaded;
}

std::vector<Vec3> shaded_normals(const PolygonMesh& mesh, const std::vector<Index>& corner_vertices,
                                 std::size_t num_vertices) {
  const std::vector<Vec3> areas = area_vectors(mesh);
  std::vector<Vec3> normals(num_vertices, Vec3::Zero());
  for (std::size_t f = 0; f < mesh.num_faces(); ++f)
    for (std::size_t k = mesh.face_offsets[f]; k < mesh.face_offsets[f + 1]; ++k)
      normals[corner_vertices[k]] += areas[f];
  for (Vec3& normal : normals) normal = normal.norm() > 0 ? Vec3(normal.stableNormalized()) : Vec3::UnitZ();
  return normals;
}

}  // namespace subvol::internal
