// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/target/carried_groups.h"

#include "subvol/base/error.h"
#include "subvol/base/format.h"
#include "subvol/fit/geometry/boundary_triangles.h"
#include "subvol/fit/geometry/closest_point.h"
#include "subvol/fit/target/soup_topology.h"
#include "subvol/surface/boundary.h"
#include "subvol/surface/solid_topology.h"
#include "subvol/surface/triangle_geometry.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <numeric>
#include <string>
#include <utility>

namespace subvol::internal {

namespace {

/// Cosine of the largest angle between normals that agree: 60 degrees. Faces of a coarse mesh deviate from the surface
/// by some 30; sides of a sharp edge that matter here are further apart.
constexpr double kLeastAgreeingCosine = 0.5;

std::vector<Vec3> normals_of(const TriangleMesh& mesh) {
  std::vector<Vec3> normals;
  normals.reserve(mesh.triangles.size());
  for (const auto& t : mesh.triangles) normals.push_back(doubled_area_vector(mesh, t).stableNormalized());
  return normals;
}

/// Points on the faces: the centers of the four equal parts of each triangle.
struct Samples {
  std::vector<Vec3> points, normals;
  std::vector<double> areas;
  std::vector<Index> faces;
};

Samples samples_of(const CurvedBoundary& boundary) {
  constexpr double kNearCornerWeight = 2.0 / 3, kFarCornerWeight = 1.0 / 6;  // at the centers of the three outer parts
  Samples samples;
  const TriangleMesh& mesh = boundary.triangles;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& [a, b, c] = mesh.triangles[t];
    const Vec3 vector = doubled_area_vector(mesh, mesh.triangles[t]);
    const Vec3 sum = mesh.positions[a] + mesh.positions[b] + mesh.positions[c];
    samples.points.push_back(sum / 3);
    for (const Index v : mesh.triangles[t])
      samples.points.push_back(kFarCornerWeight * sum + (kNearCornerWeight - kFarCornerWeight) * mesh.positions[v]);
    samples.normals.insert(samples.normals.end(), 4, vector.stableNormalized());
    samples.areas.insert(samples.areas.end(), 4, vector.norm() / 8);
    samples.faces.insert(samples.faces.end(), 4, boundary.faces[t]);
  }
  return samples;
}

/// Returns the 26 directions to the faces, edges and corners of a cube. Every direction is within 28 degrees of one.
std::vector<Vec3> directions() {
  std::vector<Vec3> found;
  for (int x = -1; x <= 1; ++x)
    for (int y = -1; y <= 1; ++y)
      for (int z = -1; z <= 1; ++z)
        if (x || y || z) found.push_back(Vec3(x, y, z).normalized());
  return found;
}

/// A target whose triangles agree about the outside, if that can be had.
struct OrientedTarget {
  TriangleMesh surface;
  bool is_oriented;  ///< false: a normal may point either way
};

/// Files often orient their groups one by one, some outward and some inward.
OrientedTarget oriented(const TriangleMesh& target) {
  try {
    return {solid_boundary(target).surface, true};
  } catch (const InputError&) {  // it bounds no solid
    return {target, soup_topology(target.positions, target.triangles).turned_edges == 0};
  }
}

/// Finds the triangle of the target that each sample lies on.
class TriangleFinder {
 public:
  explicit TriangleFinder(const OrientedTarget& target)
      : target_(target.surface), normals_(normals_of(target.surface)), is_oriented_(target.is_oriented) {}

  std::vector<Index> find(const Samples& samples, const std::vector<double>& reach) {
    std::vector<ClosestPoint::Hit> hits(samples.points.size());
    ClosestPoint(target_).closest(samples.points, hits);
    orient(samples, hits);
    std::map<std::size_t, std::vector<std::size_t>> doubtful;  // samples by direction
    const std::vector<Vec3> all = directions();
    for (std::size_t i = 0; i < hits.size(); ++i) {
      if (hits[i].triangle == kNoIndex || agrees(hits[i].triangle, samples.normals[i])) continue;
      std::size_t best = 0;
      for (std::size_t d = 1; d < all.size(); ++d)
        if (all[d].dot(samples.normals[i]) > all[best].dot(samples.normals[i])) best = d;
      doubtful[best].push_back(i);
    }
    for (const auto& [direction, group] : doubtful) find_again(all[direction], group, samples, reach, hits);
    std::vector<Index> triangles;
    for (const ClosestPoint::Hit& hit : hits) triangles.push_back(hit.triangle);
    return triangles;
  }

 private:
  bool agrees(Index triangle, const Vec3& normal) const {
    const double cosine = normals_[triangle].dot(normal);
    return (is_oriented_ ? cosine : std::abs(cosine)) >= kLeastAgreeingCosine;
  }

  /// Turns the normals of a target that is oriented inward.
  void orient(const Samples& samples, const std::vector<ClosestPoint::Hit>& hits) {
    double sum = 0;
    for (std::size_t i = 0; i < hits.size(); ++i)
      if (hits[i].triangle != kNoIndex) sum += samples.areas[i] * normals_[hits[i].triangle].dot(samples.normals[i]);
    if (sum < 0)
      for (Vec3& normal : normals_) normal = -normal;
  }

  /// Looks for closest points of some samples among the triangles that face a direction.
  void find_again(const Vec3& direction, const std::vector<std::size_t>& group, const Samples& samples,
                  const std::vector<double>& reach, std::vector<ClosestPoint::Hit>& hits) const {
    TriangleMesh part{target_.positions, {}};
    std::vector<Index> number;
    for (std::size_t t = 0; t < normals_.size(); ++t) {
      if (!agrees(static_cast<Index>(t), direction)) continue;
      part.triangles.push_back(target_.triangles[t]);
      number.push_back(static_cast<Index>(t));
    }
    if (number.empty()) return;
    std::vector<Vec3> points;
    for (const std::size_t i : group) points.push_back(samples.points[i]);
    std::vector<ClosestPoint::Hit> found(points.size());
    ClosestPoint(part).closest(points, found);
    for (std::size_t k = 0; k < group.size(); ++k) {
      const std::size_t i = group[k];
      if (found[k].triangle == kNoIndex || !(found[k].distance <= hits[i].distance + reach[samples.faces[i]])) continue;
      hits[i] = found[k];
      hits[i].triangle = number[found[k].triangle];
    }
  }

  const TriangleMesh& target_;
  std::vector<Vec3> normals_;
  bool is_oriented_;
};

/// Area of a face that lies on one group.
struct Share {
  Index face, group;
  double area;
};

std::vector<Index> largest_shares(std::vector<Share> shares, const std::vector<Group>& groups, std::size_t num_faces) {
  std::stable_sort(shares.begin(), shares.end(), [](const Share& a, const Share& b) {
    return a.face != b.face ? a.face < b.face : a.group < b.group;
  });
  std::vector<Index> best(num_faces, kNoIndex);
  std::vector<double> most(num_faces, 0);
  for (std::size_t i = 0, end = 0; i < shares.size(); i = end) {
    double area = 0;
    for (; end < shares.size() && shares[end].face == shares[i].face && shares[end].group == shares[i].group; ++end)
      area += shares[end].area;
    const Index face = shares[i].face, group = shares[i].group;
    const bool is_lower =
        group != kNoIndex && (best[face] == kNoIndex || groups[group].number < groups[best[face]].number);
    if (area > most[face] || (area == most[face] && is_lower)) most[face] = area, best[face] = group;
  }
  return best;
}

/// Gives a group that no face lies mostly on the face that is nearest to the middle of its largest triangle, if that is
/// no farther than the face is wide and the face's own group has another one. Large groups come first.
///
/// reach  width of each face.
void keep_small_groups(const TriangleMesh& target, const CurvedBoundary& boundary, const std::vector<double>& reach,
                       std::vector<Index>& group_of_face) {
  std::vector<std::size_t> faces(target.face_groups.groups.size(), 0);
  for (const Index group : group_of_face)
    if (group != kNoIndex) ++faces[group];
  std::vector<std::pair<double, std::size_t>> largest(faces.size(), {0, 0});  // area and number of a triangle
  for (std::size_t t = 0; t < target.triangles.size(); ++t) {
    const Index group = target.face_groups.of_face[t];
    if (group == kNoIndex || faces[group] > 0) continue;
    largest[group] = std::max(largest[group], {doubled_area_vector(target, target.triangles[t]).norm(), t});
  }
  std::ranges::sort(largest, std::greater{});
  std::erase_if(largest, [](const auto& triangle) { return triangle.first == 0; });
  if (largest.empty()) return;
  const ClosestPoint tree(boundary.triangles);
  for (const auto& [area, t] : largest) {
    Vec3 middle = Vec3::Zero();
    for (const Index v : target.triangles[t]) middle += target.positions[v] / 3;
    const ClosestPoint::Hit hit = tree.closest(middle);
    if (hit.triangle == kNoIndex) continue;
    const Index face = boundary.faces[hit.triangle], own = group_of_face[face];
    if (hit.distance > reach[face] || (own != kNoIndex && faces[own] < 2)) continue;
    if (own != kNoIndex) --faces[own];
    group_of_face[face] = target.face_groups.of_face[t];
    ++faces[group_of_face[face]];
  }
}

}  // namespace

std::vector<Index> carried_groups(const TriangleMesh& target, const CurvedBoundary& boundary, std::size_t num_faces) {
  if (target.face_groups.empty()) return {};
  const Samples samples = samples_of(boundary);
  std::vector<double> reach(num_faces, 0);
  for (std::size_t i = 0; i < samples.faces.size(); ++i) reach[samples.faces[i]] += samples.areas[i];
  for (double& area : reach) area = std::sqrt(area);
  const OrientedTarget surface = oriented(target);
  const std::vector<Index> triangles = TriangleFinder(surface).find(samples, reach);
  const std::vector<Index>& groups = surface.surface.face_groups.of_face;
  std::vector<Share> shares;
  for (std::size_t i = 0; i < triangles.size(); ++i)
    if (triangles[i] != kNoIndex) shares.push_back({samples.faces[i], groups[triangles[i]], samples.areas[i]});
  std::vector<Index> best = largest_shares(std::move(shares), target.face_groups.groups, num_faces);
  keep_small_groups(surface.surface, boundary, reach, best);
  return best;
}

FaceGroups groups_of_pieces(const TriangleMesh& surface, const TriangleMesh& pieces) {
  std::vector<Index> numbers(pieces.triangles.size());
  std::iota(numbers.begin(), numbers.end(), 0);
  return {surface.face_groups.groups, carried_groups(surface, {pieces, numbers, 0}, numbers.size())};
}

CurvedBoundary linear_boundary(const VolumeMesh& mesh, const MeshTopology& topology) {
  CurvedBoundary boundary;
  boundary.triangles = refined_triangles(boundary_surface(mesh, topology), &boundary.faces);
  return boundary;
}

VolumeFaceGroups with_carried_groups(const TriangleMesh& target, std::vector<Index> carried,
                                     const VolumeFaceGroups& own, const MeshTopology& topology) {
  if (target.face_groups.empty()) return own;
  VolumeFaceGroups groups = groups_from_boundary(target.face_groups.groups, topology, carried);
  if (own.empty()) return groups;
  VolumeFaceGroups rest;
  std::vector<char> is_left(own.groups.size(), 0);
  for (const GroupedFace& entry : own.faces) {
    const std::span<const Index> corners(entry.face.data(), entry.face.back() == kNoIndex ? 3 : 4);
    if (group_of(groups, corners) != kNoIndex) continue;
    rest.faces.push_back(entry);
    is_left[entry.group] = 1;
  }
  // In the order of the own groups, so that the groups of a cage and of its mesh get the same numbers.
  std::vector<Index> place(own.groups.size(), kNoIndex);
  for (std::size_t g = 0; g < own.groups.size(); ++g) {
    if (!is_left[g]) continue;
    place[g] = static_cast<Index>(rest.groups.size());
    rest.groups.push_back(own.groups[g]);
  }
  for (GroupedFace& entry : rest.faces) entry.group = place[entry.group];
  append_groups(groups, rest, 0);
  return groups;
}

std::vector<CarriedGroup> areas_of_groups(const TriangleMesh& target, const CurvedBoundary& boundary,
                                          const std::vector<Index>& carried) {
  std::vector<CarriedGroup> all;
  for (const Group& group : target.face_groups.groups) all.push_back({.group = group});
  if (all.empty()) return all;
  std::vector<char> has_triangles(all.size(), 0);
  for (std::size_t t = 0; t < target.triangles.size(); ++t) {
    const Index group = target.face_groups.of_face[t];
    if (group == kNoIndex) continue;
    all[group].target_area += doubled_area_vector(target, target.triangles[t]).norm() / 2;
    has_triangles[group] = 1;
  }
  for (const Index group : carried)
    if (group != kNoIndex) ++all[group].faces;
  const TriangleMesh& mesh = boundary.triangles;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    if (const Index group = carried[boundary.faces[t]]; group != kNoIndex)
      all[group].area += doubled_area_vector(mesh, mesh.triangles[t]).norm() / 2;
  std::vector<CarriedGroup> found;
  for (std::size_t g = 0; g < all.size(); ++g)
    if (has_triangles[g]) found.push_back(std::move(all[g]));
  return found;
}

std::vector<std::string> warnings_of_groups(const std::vector<CarriedGroup>& groups) {
  double whole = 0;
  for (const CarriedGroup& group : groups) whole += group.target_area;
  std::vector<std::string> warnings;
  for (const CarriedGroup& group : groups) {
    const double difference = std::abs(group.area - group.target_area);
    if (group.is_lost()) {
      warnings.push_back("the group " + label_of(group.group) + " is lost: no boundary face lies mostly on it" +
                         formatted(" (its area on the target is %.6g)", group.target_area));
    } else if (difference > std::max(kMostAreaDifference * group.target_area, kMostShareOfWhole * whole)) {
      warnings.push_back("the area of the group " + label_of(group.group) +
                         formatted(" is %.6g, on the target it is %.6g (%+.1f %%)", group.area, group.target_area,
                                   100 * (group.area / group.target_area - 1)));
    }
  }
  return warnings;
}

}  // namespace subvol::internal
