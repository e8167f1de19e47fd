// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/export/polygon_shading.h"

#include "subvol/base/error.h"
#include "subvol/export/text_format.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

namespace subvol::internal {
namespace {

struct Corner {
  std::size_t entry;   ///< index in face_vertices
  std::size_t face;
  Index before, after; ///< the neighbors on the face
};

std::vector<std::vector<Corner>> corners_of_vertices(const PolygonMesh& mesh) {
  std::vector<std::vector<Corner>> corners(mesh.positions.size());
  for (std::size_t f = 0; f < mesh.num_faces(); ++f)
    for (std::size_t begin = mesh.face_offsets[f], end = mesh.face_offsets[f + 1], k = begin; k < end; ++k)
      corners[mesh.face_vertices[k]].push_back({k, f, mesh.face_vertices[k == begin ? end - 1 : k - 1],
                                                mesh.face_vertices[k + 1 == end ? begin : k + 1]});
  return corners;
}

std::vector<Vec3> area_vectors(const PolygonMesh& mesh) {
  std::vector<Vec3> areas(mesh.num_faces(), Vec3::Zero());
  for (std::size_t f = 0; f < mesh.num_faces(); ++f) {
    const Vec3& first = mesh.positions[mesh.face_vertices[mesh.face_offsets[f]]];
    for (std::size_t k = mesh.face_offsets[f] + 1; k + 1 < mesh.face_offsets[f + 1]; ++k)
      areas[f] += (mesh.positions[mesh.face_vertices[k]] - first)
                      .cross(mesh.positions[mesh.face_vertices[k + 1]] - first) / 2;
  }
  return areas;
}

/// Returns the first corner of the group of each corner: groups grow over smooth edges.
std::vector<std::size_t> smooth_groups(const std::vector<Corner>& corners, const std::vector<Vec3>& areas,
                                       double cos_angle) {
  std::vector<std::pair<Index, std::size_t>> spokes;  // the other end of an edge at the vertex, and the corner
  for (std::size_t i = 0; i < corners.size(); ++i) {
    spokes.push_back({corners[i].before, i});
    spokes.push_back({corners[i].after, i});
  }
  std::sort(spokes.begin(), spokes.end());
  std::vector<std::size_t> group(corners.size());
  std::iota(group.begin(), group.end(), std::size_t{0});
  const auto root = [&](std::size_t i) {
    while (group[i] != i) i = group[i] = group[group[i]];
    return i;
  };
  for (std::size_t s = 0; s < spokes.size(); ++s)
    for (std::size_t t = s + 1; t < spokes.size() && spokes[t].first == spokes[s].first; ++t) {
      const std::size_t i = root(spokes[s].second), j = root(spokes[t].second);
      const Vec3 &a = areas[corners[spokes[t].second].face], &b = areas[corners[spokes[s].second].face];
      if (i != j && a.dot(b) > cos_angle * a.norm() * b.norm()) group[std::max(i, j)] = std::min(i, j);
    }
  for (std::size_t& g : group) g = root(g);
  return group;
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
    const std::vector<std::size_t> group = smooth_groups(corners, areas, cos_angle);
    for (std::size_t i = 0; i < corners.size(); ++i) {
      if (group[i] == i) {
        shaded.corner_vertices[corners[i].entry] = static_cast<Index>(shaded.positions.size());
        shaded.positions.push_back(mesh.positions[v]);
      } else {
        shaded.corner_vertices[corners[i].entry] = shaded.corner_vertices[corners[group[i]].entry];
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
