// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/features/flat_facets.h"

#include "subvol/fit/geometry/surface_distance.h"
#include "subvol/surface/triangle_geometry.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <utility>

namespace subvol::internal {

namespace {

/// The triangles across the edges of each triangle.
std::vector<std::vector<Index>> neighbors_of(const TriangleMesh& mesh) {
  std::vector<std::pair<std::array<Index, 2>, Index>> edges;
  edges.reserve(3 * mesh.triangles.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (int k = 0; k < 3; ++k) {
      const auto [low, high] = std::minmax(mesh.triangles[t][k], mesh.triangles[t][(k + 1) % 3]);
      edges.push_back({{low, high}, static_cast<Index>(t)});
    }
  std::sort(edges.begin(), edges.end());
  std::vector<std::vector<Index>> neighbors(mesh.triangles.size());
  for (std::size_t i = 0; i + 1 < edges.size(); ++i) {
    if (edges[i].first != edges[i + 1].first) continue;
    neighbors[edges[i].second].push_back(edges[i + 1].second);
    neighbors[edges[i + 1].second].push_back(edges[i].second);
  }
  return neighbors;
}

/// Grows facets one after the other.
class FacetGrower {
 public:
  explicit FacetGrower(const TriangleMesh& mesh)
      : mesh_(mesh), neighbors_(neighbors_of(mesh)), tolerance_(kFlatTolerance * bounding_box_diagonal(mesh)) {
    facets_.of_triangle.assign(mesh.triangles.size(), kNoIndex);
  }

  FlatFacets run() {
    std::vector<double> areas;
    for (std::size_t t = 0; t < mesh_.triangles.size(); ++t)
      areas.push_back(doubled_area_vector(mesh_, mesh_.triangles[t]).norm());
    std::vector<std::size_t> order(areas.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return areas[a] > areas[b]; });
    for (const std::size_t t : order)
      if (areas[t] > 0 && facets_.of_triangle[t] == kNoIndex) grow(static_cast<Index>(t));
    return std::move(facets_);
  }

 private:
  bool is_in_plane(std::size_t t, const FacetPlane& plane) const {
    const auto& corners = mesh_.triangles[t];
    return doubled_area_vector(mesh_, mesh_.triangles[t]).dot(plane.normal) > 0 &&
           std::all_of(corners.begin(), corners.end(), [&](Index v) {
             return std::abs(plane.normal.dot(mesh_.positions[v]) - plane.offset) <= tolerance_;
           });
  }

  void grow(Index seed) {
    const auto facet = static_cast<Index>(facets_.planes.size());
    const Vec3 normal = doubled_area_vector(mesh_, mesh_.triangles[seed]).normalized();
    const FacetPlane plane{normal, normal.dot(mesh_.positions[mesh_.triangles[seed][0]])};
    std::vector<Index> members{seed};
    facets_.of_triangle[seed] = facet;
    for (std::size_t i = 0; i < members.size(); ++i)
      for (const Index t : neighbors_[members[i]]) {
        if (facets_.of_triangle[t] != kNoIndex || !is_in_plane(static_cast<std::size_t>(t), plane)) continue;
        facets_.of_triangle[t] = facet;
        members.push_back(t);
      }
    facets_.planes.push_back(fitted_plane(members));
  }

  FacetPlane fitted_plane(const std::vector<Index>& members) const {
    Vec3 normal = Vec3::Zero(), center = Vec3::Zero();
    double area = 0;
    for (const Index t : members) {
      const Vec3 vector = doubled_area_vector(mesh_, mesh_.triangles[t]);
      const auto& [a, b, c] = mesh_.triangles[t];
      normal += vector;
      area += vector.norm();
      center += vector.norm() / 3 * (mesh_.positions[a] + mesh_.positions[b] + mesh_.positions[c]);
    }
    normal.normalize();
    return {normal, normal.dot(center) / area};
  }

  const TriangleMesh& mesh_;
  std::vector<std::vector<Index>> neighbors_;
  double tolerance_;
  FlatFacets facets_;
};

}  // namespace

FlatFacets flat_facets(const TriangleMesh& surface) { return FacetGrower(surface).run(); }

}  // namespace subvol::internal
