// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/fits/flat_faces.h"

#include "subvol/base/disjoint_sets.h"
#include "subvol/fit/geometry/grouped_closest_point.h"
#include "subvol/fit/geometry/surface_distance.h"
#include "subvol/fit/quality/quality.h"
#include "subvol/mesh/interfaces.h"
#include "subvol/mesh/mesh_topology.h"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <optional>
#include <span>
#include <vector>

namespace subvol::internal {

namespace {

constexpr double kSameDirection = 0.9;  // cosine of 25 degrees

/// Finds the closest triangle of the surface that a sheet is to reproduce; the hint is a triangle or kNoIndex.
using Closest = std::function<ClosestPoint::Hit(const Vec3& point, Index group, Index hint)>;

/// Returns the facet that a face lies on, or kNoIndex.
Index facet_of_face(std::span<const Index> corners, Index group, const VolumeMesh& mesh, const Closest& closest,
                    const FlatFacets& facets) {
  Vec3 center = Vec3::Zero();
  for (const Index v : corners) center += mesh.positions[v] / static_cast<double>(corners.size());
  const ClosestPoint::Hit hit = closest(center, group, kNoIndex);
  const Index facet = hit.triangle == kNoIndex ? kNoIndex : facets.of_triangle[hit.triangle];
  if (facet == kNoIndex) return kNoIndex;
  Vec3 normal = Vec3::Zero();
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Vec3 &p = mesh.positions[corners[i]], &next = mesh.positions[corners[(i + 1) % corners.size()]];
    normal += (p - center).cross(next - center);
    const ClosestPoint::Hit halfway = closest(0.5 * (center + p), group, hit.triangle);
    if (halfway.triangle == kNoIndex || facets.of_triangle[halfway.triangle] != facet) return kNoIndex;
  }
  return std::abs(normal.normalized().dot(facets.planes[facet].normal)) >= kSameDirection ? facet : kNoIndex;
}

/// Returns the facets whose planes each vertex must lie in. group: of each face of the topology; kNoIndex: on no sheet.
std::vector<std::vector<Index>> facets_of_vertices(const VolumeMesh& mesh, const MeshTopology& topology,
                                                   std::span<const Index> group, const Closest& closest,
                                                   const FlatFacets& facets) {
  std::vector<Index> faces;
  for (std::size_t f = 0; f < group.size(); ++f)
    if (group[f] != kNoIndex) faces.push_back(static_cast<Index>(f));
  std::vector<Index> of_face(faces.size());
#pragma omp parallel for schedule(dynamic, 64)
  for (std::size_t i = 0; i < faces.size(); ++i)
    of_face[i] = facet_of_face(topology.face(faces[i]), group[faces[i]], mesh, closest, facets);
  std::vector<std::vector<Index>> result(mesh.num_vertices());
  for (std::size_t i = 0; i < faces.size(); ++i) {
    if (of_face[i] == kNoIndex) continue;
    for (const Index v : topology.face(faces[i])) {
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
  constexpr double kLeastPlaneEigenvalue = 3e-3;
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
    if (solver.eigenvalues()[k] > kLeastPlaneEigenvalue)
      way += solver.eigenvectors().col(k).dot(right) / solver.eigenvalues()[k] * solver.eigenvectors().col(k);
  for (const Index f : list)
    if (!(std::abs(facets.planes[f].normal.dot(p + way) - facets.planes[f].offset) <= tolerance)) return std::nullopt;
  return way;
}

/// Returns the length of the shortest edge at each vertex.
std::vector<double> shortest_edges(const VolumeMesh& mesh) {
  const MeshTopology topology(mesh);
  std::vector<double> shortest(mesh.num_vertices(), std::numeric_limits<double>::infinity());
  for (std::size_t e = 0; e < topology.num_edges(); ++e) {
    const auto& [a, b] = topology.edge(static_cast<Index>(e));
    const double length = (mesh.positions[a] - mesh.positions[b]).norm();
    for (const Index v : {a, b}) shortest[v] = std::min(shortest[v], length);
  }
  return shortest;
}

/// Refers to what is made flat: a mesh whose own cells are judged, or a cage whose mesh's cells are judged.
class Flattened {
 public:
  explicit Flattened(VolumeMesh& mesh) : moved(mesh) {}
  explicit Flattened(FittedCage& cage) : moved(cage.cage), cage_(&cage) {}

  VolumeMesh& moved;  ///< the mesh whose vertices move

  /// Returns the mesh whose cells are judged. Vertex v of a cage is vertex v of its mesh.
  VolumeMesh judged() const { return cage_ ? cage_->mesh() : moved; }

  /// Returns the lengths that moves are compared with: each vertex's shortest edge in the judged mesh, twice that if
  /// two of these make an edge of the cage.
  std::vector<double> sizes() const {
    std::vector<double> sizes = shortest_edges(judged());
    if (cage_)
      for (double& size : sizes) size *= 2;
    return sizes;
  }

  /// Puts the vertices of a judged cell back. Of a cage, they are those of the cell that it is a part of, and if these
  /// have not moved, all that move it.
  void put_back(Index cell, std::span<const Vec3> before) {
    const auto c = static_cast<std::size_t>(cell);
    if (put_back(moved.cell(cage_ ? c / kChildren : c), before) || !cage_) return;
    const FitLevel& level = cage_->level();
    for (const Index v : level.mesh.cell(c)) put_back(level.nodes.row_columns(v), before);
  }

 private:
  /// Returns whether one of these vertices had moved.
  bool put_back(std::span<const Index> vertices, std::span<const Vec3> before) {
    bool had_moved = false;
    for (const Index v : vertices) {
      had_moved = had_moved || moved.positions[v] != before[v];
      moved.positions[v] = before[v];
    }
    return had_moved;
  }

  FittedCage* cage_ = nullptr;
};

/// Puts vertices of cells that have suffered back: that are poorer than before and than `least`. Returns false if there
/// are none.
bool put_back(Flattened& flattened, std::span<const Vec3> before, const QualityReport& quality_before, double least) {
  const QualityReport now = measure_quality(flattened.judged());
  std::vector<Index> bad = now.certificate.not_certified;
  const auto& known = quality_before.certificate.not_certified;
  std::erase_if(bad, [&](Index c) { return std::binary_search(known.begin(), known.end(), c); });
  for (std::size_t c = 0; c < now.cell_minima.size(); ++c)
    if (now.cell_minima[c] < std::min(quality_before.cell_minima[c], least)) bad.push_back(static_cast<Index>(c));
  for (const Index c : bad) flattened.put_back(c, before);
  return !bad.empty();
}

/// Moves vertices into their planes, as far as cells allow. tolerance: distance from a plane that counts as in it.
std::size_t flatten(Flattened flattened, const MeshTopology& topology, std::span<const Index> group,
                    const Closest& closest, const FlatFacets& facets, double tolerance, double least_jacobian) {
  constexpr double kLongestWayToPlanes = 0.1;  // of a vertex's size
  constexpr int kMostPutBackRounds = 20;       // each puts more vertices back; then all are
  VolumeMesh& mesh = flattened.moved;
  const std::vector<std::vector<Index>> wanted = facets_of_vertices(mesh, topology, group, closest, facets);
  const std::vector<double> sizes = flattened.sizes();
  const std::vector<Vec3> before = mesh.positions;
  const QualityReport quality = measure_quality(flattened.judged());
  for (std::size_t v = 0; v < wanted.size(); ++v) {
    if (wanted[v].empty()) continue;
    const std::optional<Vec3> way = way_to_planes(before[v], wanted[v], facets, tolerance);
    if (way && way->norm() <= kLongestWayToPlanes * sizes[v]) mesh.positions[v] += *way;
  }
  int round = 0;
  while (put_back(flattened, before, quality, std::min(quality.min_scaled_jacobian, least_jacobian)))
    if (++round == kMostPutBackRounds) {
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

std::vector<Index> boundary_group(const MeshTopology& topology) {
  std::vector<Index> group(topology.num_faces(), kNoIndex);
  for (const Index f : topology.boundary_faces()) group[f] = 0;
  return group;
}

std::size_t flatten_boundary(Flattened flattened, const TriangleMesh& target, const ClosestPoint& tree,
                             const FlatFacets& facets) {
  const MeshTopology topology(flattened.moved);
  return flatten(
      flattened, topology, boundary_group(topology),
      [&](const Vec3& point, Index, Index hint) { return tree.closest(point, hint); }, facets,
      kFlatTolerance * bounding_box_diagonal(target), 1);
}

std::size_t flatten_all(Flattened flattened, const FitTarget& target, double least_jacobian) {
  FlatFacets facets = flat_facets(target.mesh);
  if (!target.has_interfaces()) return flatten_boundary(flattened, target.mesh, *target.tree, facets);
  const MeshTopology topology(flattened.moved);
  const FlatFacets inner = flat_facets(target.interfaces);
  const auto first_plane = static_cast<Index>(facets.planes.size());
  const auto first_triangle = static_cast<Index>(facets.of_triangle.size());
  facets.planes.insert(facets.planes.end(), inner.planes.begin(), inner.planes.end());
  for (const Index f : inner.of_triangle) facets.of_triangle.push_back(f == kNoIndex ? kNoIndex : first_plane + f);
  const GroupedClosestPoint tree(target.interfaces, target.group_of_interface_triangle);
  const Closest closest = [&](const Vec3& point, Index group, Index hint) {
    if (group == 0) return target.tree->closest(point, hint);
    ClosestPoint::Hit hit = tree.closest(point, group, hint == kNoIndex ? kNoIndex : hint - first_triangle);
    if (hit.triangle != kNoIndex) hit.triangle += first_triangle;
    return hit;
  };
  return flatten(flattened, topology, groups_of_sheets(flattened.moved, topology), closest, facets,
                 kFlatTolerance * bounding_box_diagonal(target.mesh), least_jacobian);
}

}  // namespace

std::size_t flatten_faces(VolumeMesh& mesh, const TriangleMesh& target, const ClosestPoint& tree,
                          const FlatFacets& facets) {
  return flatten_boundary(Flattened(mesh), target, tree, facets);
}

std::size_t flatten_faces(FittedCage& cage, const TriangleMesh& target, const ClosestPoint& tree,
                          const FlatFacets& facets) {
  return flatten_boundary(Flattened(cage), target, tree, facets);
}

std::size_t flatten_sheets(VolumeMesh& mesh, const FitTarget& target, double least_jacobian) {
  return flatten_all(Flattened(mesh), target, least_jacobian);
}

std::size_t flatten_sheets(FittedCage& cage, const FitTarget& target, double least_jacobian) {
  return flatten_all(Flattened(cage), target, least_jacobian);
}

std::size_t flatten_interface_patches(VolumeMesh& cage, const FitTarget& target) {
  const MeshTopology topology(cage);
  const Interfaces interfaces = find_interfaces(cage, topology);
  if (interfaces.empty() || !target.has_interfaces()) return 0;
  const FlatFacets facets = flat_facets(target.interfaces);
  const GroupedClosestPoint tree(target.interfaces, target.group_of_interface_triangle);
  const Closest closest = [&](const Vec3& point, Index group, Index hint) { return tree.closest(point, group, hint); };
  const std::vector<Index> groups = groups_of_sheets(cage, topology);

  const InterfaceMarks marks = mark_interfaces(topology, interfaces);
  std::vector<char> is_sharp = marks.curves;
  for (const CreaseEdge& crease : cage.tags.creases) is_sharp[topology.find_edge(crease.v0, crease.v1)] = 1;
  DisjointSets patches(interfaces.faces.size());
  std::vector<Index> first_face(topology.num_edges(), kNoIndex);
  for (std::size_t i = 0; i < patches.size(); ++i) {
    const auto face = topology.face(interfaces.faces[i]);
    for (std::size_t k = 0; k < face.size(); ++k) {
      const Index e = topology.find_edge(face[k], face[(k + 1) % face.size()]);
      if (is_sharp[e]) continue;
      if (first_face[e] == kNoIndex)
        first_face[e] = static_cast<Index>(i);
      else
        patches.join(static_cast<Index>(i), first_face[e]);
    }
  }
  constexpr Index kUnknownFacet = -2;
  std::vector<Index> facet_of_patch(patches.size(), kUnknownFacet);
  for (std::size_t i = 0; i < patches.size(); ++i) {
    const Index f = interfaces.faces[i];
    const Index facet = facet_of_face(topology.face(f), groups[f], cage, closest, facets);
    Index& common = facet_of_patch[patches.of(static_cast<Index>(i))];
    common = common == kUnknownFacet || common == facet ? facet : kNoIndex;
  }
  std::vector<std::vector<Index>> wanted(cage.num_vertices());
  for (std::size_t i = 0; i < patches.size(); ++i) {
    const Index facet = facet_of_patch[patches.of(static_cast<Index>(i))];
    if (facet == kNoIndex) continue;
    for (const Index v : topology.face(interfaces.faces[i]))
      if (std::find(wanted[v].begin(), wanted[v].end(), facet) == wanted[v].end()) wanted[v].push_back(facet);
  }
  std::size_t moved = 0;
  for (std::size_t v = 0; v < wanted.size(); ++v) {
    if (wanted[v].empty()) continue;
    const auto way =
        way_to_planes(cage.positions[v], wanted[v], facets, kFlatTolerance * bounding_box_diagonal(target.mesh));
    if (!way) continue;
    cage.positions[v] += *way;
    ++moved;
  }
  return moved;
}

}  // namespace subvol::internal
