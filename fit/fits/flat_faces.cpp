// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/fits/flat_faces.h"

#include "subvol/fit/geometry/surface_distance.h"
#include "subvol/fit/quality/quality.h"
#include "subvol/mesh/mesh_topology.h"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <vector>

namespace subvol {

namespace {

constexpr double kSameDirection = 0.9;  // cosine of 25 degrees

/// Returns the facet that a boundary face lies on, or kNoIndex.
Index facet_of_face(std::span<const Index> corners, const VolumeMesh& mesh, const ClosestPoint& tree,
                    const FlatFacets& facets) {
  Vec3 centre = Vec3::Zero();
  for (const Index v : corners) centre += mesh.positions[v] / static_cast<double>(corners.size());
  const ClosestPoint::Hit hit = tree.closest(centre);
  const Index facet = hit.triangle == kNoIndex ? kNoIndex : facets.of_triangle[hit.triangle];
  if (facet == kNoIndex) return kNoIndex;
  Vec3 normal = Vec3::Zero();
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Vec3 &p = mesh.positions[corners[i]], &next = mesh.positions[corners[(i + 1) % corners.size()]];
    normal += (p - centre).cross(next - centre);
    const ClosestPoint::Hit halfway = tree.closest(0.5 * (centre + p), hit.triangle);
    if (halfway.triangle == kNoIndex || facets.of_triangle[halfway.triangle] != facet) return kNoIndex;
  }
  return std::abs(normal.normalized().dot(facets.planes[facet].normal)) >= kSameDirection ? facet : kNoIndex;
}

/// Returns the facets whose planes each vertex must lie in.
std::vector<std::vector<Index>> facets_of_vertices(const VolumeMesh& mesh, const MeshTopology& topology,
                                                   const ClosestPoint& tree, const FlatFacets& facets) {
  const auto boundary = topology.boundary_faces();
  std::vector<Index> of_face(boundary.size());
#pragma omp parallel for schedule(dynamic, 64)
  for (std::size_t i = 0; i < boundary.size(); ++i)
    of_face[i] = facet_of_face(topology.face(boundary[i]), mesh, tree, facets);
  std::vector<std::vector<Index>> result(mesh.num_vertices());
  for (std::size_t i = 0; i < boundary.size(); ++i) {
    if (of_face[i] == kNoIndex) continue;
    for (const Index v : topology.face(boundary[i])) {
      auto& list = result[v];
      if (std::find(list.begin(), list.end(), of_face[i]) == list.end()) list.push_back(of_face[i]);
    }
  }
  return result;
}

/// Returns the shortest vector that moves p into all planes, or nothing if there is none.
std::optional<Vec3> way_to_planes(const Vec3& p, std::span<const Index> list, const FlatFacets& facets,
                                  double tolerance) {
  // Planes that differ in direction by less than the square root of this (3 degrees) are taken for one.
  constexpr double kIndependent = 3e-3;
  Mat3 matrix = Mat3::Zero();
  Vec3 right = Vec3::Zero();
  for (const Index f : list) {
    const auto& [normal, offset] = facets.planes[f];
    matrix += normal * normal.transpose();
    right += (offset - normal.dot(p)) * normal;
  }
  const Eigen::SelfAdjointEigenSolver<Mat3> solver(matrix);
  Vec3 way = Vec3::Zero();
  for (int k = 0; k < 3; ++k)
    if (solver.eigenvalues()[k] > kIndependent)
      way += solver.eigenvectors().col(k).dot(right) / solver.eigenvalues()[k] * solver.eigenvectors().col(k);
  for (const Index f : list)
    if (!(std::abs(facets.planes[f].normal.dot(p + way) - facets.planes[f].offset) <= tolerance)) return std::nullopt;
  return way;
}

std::vector<double> shortest_edges(const VolumeMesh& mesh, const MeshTopology& topology) {
  std::vector<double> shortest(mesh.num_vertices(), std::numeric_limits<double>::infinity());
  for (std::size_t e = 0; e < topology.num_edges(); ++e) {
    const auto& [a, b] = topology.edge(static_cast<Index>(e));
    const double length = (mesh.positions[a] - mesh.positions[b]).norm();
    for (const Index v : {a, b}) shortest[v] = std::min(shortest[v], length);
  }
  return shortest;
}

/// Puts vertices of cells that have suffered back. Returns false if there are none.
bool put_back(VolumeMesh& mesh, std::span<const Vec3> before, const QualityReport& quality_before) {
  const QualityReport now = measure_quality(mesh);
  std::vector<Index> bad = now.certificate.not_certified;
  const auto& known = quality_before.certificate.not_certified;
  std::erase_if(bad, [&](Index c) { return std::binary_search(known.begin(), known.end(), c); });
  for (std::size_t c = 0; c < now.cell_minima.size(); ++c)
    if (now.cell_minima[c] < std::min(quality_before.cell_minima[c], quality_before.min_scaled_jacobian))
      bad.push_back(static_cast<Index>(c));
  for (const Index c : bad)
    for (const Index v : mesh.cell(static_cast<std::size_t>(c))) mesh.positions[v] = before[v];
  return !bad.empty();
}

}  // namespace

std::size_t flatten_faces(VolumeMesh& mesh, const TriangleMesh& target, const ClosestPoint& tree,
                          const FlatFacets& facets) {
  constexpr double kLongest = 0.1;  // of the shortest edge
  constexpr int kMostRounds = 20;
  const MeshTopology topology(mesh);
  const std::vector<std::vector<Index>> wanted = facets_of_vertices(mesh, topology, tree, facets);
  const std::vector<double> shortest = shortest_edges(mesh, topology);
  const double tolerance = kFlatTolerance * bounding_box_diagonal(target);
  const std::vector<Vec3> before = mesh.positions;
  const QualityReport quality = measure_quality(mesh);
  for (std::size_t v = 0; v < wanted.size(); ++v) {
    if (wanted[v].empty()) continue;
    const std::optional<Vec3> way = way_to_planes(before[v], wanted[v], facets, tolerance);
    if (way && way->norm() <= kLongest * shortest[v]) mesh.positions[v] += *way;
  }
  int round = 0;
  while (put_back(mesh, before, quality))
    if (++round == kMostRounds) {
      mesh.positions = before;
      break;
    }
  std::size_t flat = 0;
  for (std::size_t v = 0; v < wanted.size(); ++v)
    flat += !wanted[v].empty() && std::all_of(wanted[v].begin(), wanted[v].end(), [&](Index f) {
      return std::abs(facets.planes[f].normal.dot(mesh.positions[v]) - facets.planes[f].offset) <= tolerance;
    });
  return flat;
}

}  // namespace subvol
