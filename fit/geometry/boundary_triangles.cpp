// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/geometry/boundary_triangles.h"

#include <algorithm>
#include <cstdint>

namespace subvol::internal {

namespace {

/// Returns, for every corner of every polygon, the number of the edge that starts there, by first appearance.
std::vector<Index> number_edges(const PolygonMesh& polygons, std::size_t& num_edges) {
  struct Use {
    std::uint64_t key;
    std::size_t corner;
  };
  std::vector<Use> uses;
  uses.reserve(polygons.face_vertices.size());
  for (std::size_t f = 0; f < polygons.num_faces(); ++f) {
    const std::size_t begin = polygons.face_offsets[f], end = polygons.face_offsets[f + 1];
    for (std::size_t corner = begin; corner < end; ++corner) {
      const Index v = polygons.face_vertices[corner], w = polygons.face_vertices[corner + 1 < end ? corner + 1 : begin];
      uses.push_back(
          {static_cast<std::uint64_t>(std::min(v, w)) << 32 | static_cast<std::uint32_t>(std::max(v, w)), corner});
    }
  }
  std::sort(uses.begin(), uses.end(),
            [](const Use& a, const Use& b) { return a.key != b.key ? a.key < b.key : a.corner < b.corner; });
  std::vector<std::size_t> first_corner(uses.size());
  for (std::size_t i = 0; i < uses.size(); ++i)
    first_corner[uses[i].corner] =
        i > 0 && uses[i].key == uses[i - 1].key ? first_corner[uses[i - 1].corner] : uses[i].corner;
  std::vector<Index> edge(uses.size());
  num_edges = 0;
  for (std::size_t corner = 0; corner < edge.size(); ++corner)
    edge[corner] = first_corner[corner] == corner ? static_cast<Index>(num_edges++) : edge[first_corner[corner]];
  return edge;
}

}  // namespace

TriangleMesh refined_triangles(const PolygonMesh& polygons, std::vector<Index>* polygon_of_triangle) {
  std::size_t num_edges = 0;
  const std::vector<Index> edge = number_edges(polygons, num_edges);
  TriangleMesh result;
  result.positions = polygons.positions;
  const std::size_t first_edge = result.positions.size();
  result.positions.resize(first_edge + num_edges);
  if (polygon_of_triangle) polygon_of_triangle->clear();
  for (std::size_t f = 0; f < polygons.num_faces(); ++f) {
    const std::size_t begin = polygons.face_offsets[f], size = polygons.face_offsets[f + 1] - begin;
    if (size < 3) continue;
    const auto corner = [&](std::size_t k) { return polygons.face_vertices[begin + k % size]; };
    const auto middle = [&](std::size_t k) { return static_cast<Index>(first_edge) + edge[begin + k % size]; };
    Vec3 sum = Vec3::Zero();
    for (std::size_t k = 0; k < size; ++k) {
      sum += polygons.positions[corner(k)];
      result.positions[middle(k)] = 0.5 * (polygons.positions[corner(k)] + polygons.positions[corner(k + 1)]);
    }
    const std::size_t before = result.triangles.size();
    if (size == 3) {
      for (std::size_t k = 0; k < 3; ++k) result.triangles.push_back({corner(k), middle(k), middle(k + 2)});
      result.triangles.push_back({middle(0), middle(1), middle(2)});
    } else {
      const Index center = static_cast<Index>(result.positions.size());
      result.positions.push_back(sum / static_cast<double>(size));
      for (std::size_t k = 0; k < size; ++k) {
        result.triangles.push_back({corner(k), middle(k), center});
        result.triangles.push_back({middle(k), corner(k + 1), center});
      }
    }
    if (polygon_of_triangle)
      polygon_of_triangle->insert(polygon_of_triangle->end(), result.triangles.size() - before, static_cast<Index>(f));
  }
  return result;
}

TriangleMesh fan_triangles(const PolygonMesh& polygons, std::vector<Index>* polygon_of_triangle) {
  TriangleMesh result;
  result.positions = polygons.positions;
  result.triangles.reserve(polygons.face_vertices.size());
  if (polygon_of_triangle) polygon_of_triangle->clear();
  for (std::size_t f = 0; f < polygons.num_faces(); ++f) {
    const std::size_t begin = polygons.face_offsets[f], size = polygons.face_offsets[f + 1] - begin;
    if (size < 3) continue;
    const auto corner = [&](std::size_t k) { return polygons.face_vertices[begin + k % size]; };
    const std::size_t before = result.triangles.size();
    if (size == 3) {
      result.triangles.push_back({corner(0), corner(1), corner(2)});
    } else {
      Vec3 sum = Vec3::Zero();
      for (std::size_t k = 0; k < size; ++k) sum += polygons.positions[corner(k)];
      const auto center = static_cast<Index>(result.positions.size());
      result.positions.push_back(sum / static_cast<double>(size));
      for (std::size_t k = 0; k < size; ++k) result.triangles.push_back({corner(k), corner(k + 1), center});
    }
    if (polygon_of_triangle)
      polygon_of_triangle->insert(polygon_of_triangle->end(), result.triangles.size() - before, static_cast<Index>(f));
  }
  return result;
}

}  // namespace subvol::internal
