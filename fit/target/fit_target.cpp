// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/target/fit_target.h"

#include "subvol/base/sort_unique.h"
#include "subvol/fit/geometry/boundary_triangles.h"
#include "subvol/fit/target/enclosed_volume.h"
#include "subvol/mesh/interfaces.h"
#include "subvol/surface/sheets.h"
#include "subvol/surface/triangle_geometry.h"
#include "subvol/surface/welded_surface.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace subvol::internal {

namespace {

TriangleMesh normalized(TriangleMesh mesh, const Normalization& normalization) {
  mesh.positions = normalization.to_unit(std::move(mesh.positions));
  return mesh;
}

PointCloud normalized(const PointCloud& cloud, const Normalization& normalization) {
  return {normalization.to_unit(cloud.points)};
}

}  // namespace

FitTarget::FitTarget(const TriangleMesh& target)
    : normalization(normalization_of(target)),
      mesh(normalized(joined_at_open_edges(target), normalization)),
      tree(mesh),
      surface(mesh) {}

FitTarget::FitTarget(const PointCloud& target, PointWeights weights)
    : normalization(normalization_of(target)), surface(normalized(target, normalization), weights) {}

void FitTarget::keep_interfaces(const VolumeMesh& start) {
  if (surface.is_cloud() || has_interfaces()) return;
  const MeshTopology topology(start);
  const Interfaces found = find_interfaces(start, topology);
  if (found.empty()) return;
  std::vector<Index> face_of_triangle, groups;
  TriangleMesh triangles = fan_triangles(interface_surface(start, topology, found), &face_of_triangle);
  for (const Index f : face_of_triangle) groups.push_back(1 + found.pair_of_face[f]);
  keep_interfaces(std::move(triangles), std::move(groups));
}

void FitTarget::keep_interfaces(TriangleMesh triangles, std::vector<Index> groups) {
  if (surface.is_cloud() || has_interfaces()) return;
  interfaces = std::move(triangles);
  group_of_interface_triangle = std::move(groups);
  add_interfaces();
}

FitTarget::FitTarget(const RegionSurface& target) : FitTarget(outer_surface(target)) {
  std::vector<Index> numbers;
  interfaces = normalized(inner_surface(target, numbers), normalization);
  std::vector<std::array<int, 2>> pairs;
  for (const Index t : numbers) pairs.push_back(target.pair(static_cast<std::size_t>(t)));
  sort_unique(pairs);
  for (const Index t : numbers) {
    const auto at = std::ranges::lower_bound(pairs, target.pair(static_cast<std::size_t>(t)));
    group_of_interface_triangle.push_back(1 + static_cast<Index>(at - pairs.begin()));
  }
  const auto has_area = [&](std::size_t t) {
    std::array<Vec3, 3> x;
    for (std::size_t i = 0; i < 3; ++i)
      x[i] = (target.mesh.positions[target.mesh.triangles[t][i]] - normalization.center) / normalization.diagonal;
    return (x[1] - x[0]).cross(x[2] - x[0]).norm() > 0;
  };
  for (const bool inner : {false, true})
    for (std::size_t t = 0; t < target.sides.size(); ++t)
      if (target.is_inner(t) == inner && has_area(t)) region_triangle.push_back(static_cast<Index>(t));
  for (const double volume : target.volumes) region_volumes.push_back(volume / std::pow(normalization.diagonal, 3));
  add_interfaces();
}

void FitTarget::add_interfaces() {
  TriangleMesh all{surface.positions(), surface.triangles()};  // without triangles that have no area
  group_of_triangle.assign(all.triangles.size(), 0);
  const auto first = static_cast<Index>(all.positions.size());
  all.positions.insert(all.positions.end(), interfaces.positions.begin(), interfaces.positions.end());
  for (std::size_t t = 0; t < interfaces.triangles.size(); ++t) {
    const auto& [a, b, c] = interfaces.triangles[t];
    if (!(doubled_area_vector(interfaces, interfaces.triangles[t]).norm() > 0)) continue;
    all.triangles.push_back({first + a, first + b, first + c});
    group_of_triangle.push_back(group_of_interface_triangle[t]);
  }
  surface = TargetSurface(all, {.volume = surface.volume()});
}

namespace {

/// The triangles of a surface, sorted by group.
class TrianglesByGroup {
 public:
  /// Both must outlive this. groups: one for each triangle.
  TrianglesByGroup(const TriangleMesh& surface, std::span<const Index> groups) : surface_(surface), groups_(groups) {
    order_.resize(groups.size());
    std::iota(order_.begin(), order_.end(), Index{0});
    std::ranges::stable_sort(order_, {}, [&](Index t) { return groups_[t]; });
  }

  /// Returns the triangles of a group, with the vertices that these name.
  TriangleMesh part(Index group) const {
    const auto of = [&](Index t) { return groups_[t]; };
    const std::span<const Index> triangles(std::ranges::lower_bound(order_, group, {}, of),
                                           std::ranges::upper_bound(order_, group, {}, of));
    std::vector<Index> vertices;
    for (const Index t : triangles)
      vertices.insert(vertices.end(), surface_.triangles[t].begin(), surface_.triangles[t].end());
    sort_unique(vertices);
    TriangleMesh result;
    for (const Index v : vertices) result.positions.push_back(surface_.positions[v]);
    const auto number = [&](Index v) {
      return static_cast<Index>(std::ranges::lower_bound(vertices, v) - vertices.begin());
    };
    for (const Index t : triangles) {
      const auto& [a, b, c] = surface_.triangles[t];
      result.triangles.push_back({number(a), number(b), number(c)});
    }
    return result;
  }

 private:
  const TriangleMesh& surface_;
  std::span<const Index> groups_;
  std::vector<Index> order_;  ///< of the triangles, ascending by group
};

}  // namespace

SurfaceDistance FitTarget::interface_distance(const VolumeMesh& fitted) const {
  const MeshTopology topology(fitted);
  const Interfaces found = find_interfaces(fitted, topology);
  std::vector<Index> face_of_triangle;
  const TriangleMesh now = fan_triangles(interface_surface(fitted, topology, found), &face_of_triangle);
  std::vector<Index> groups;
  for (const Index f : face_of_triangle) groups.push_back(1 + found.pair_of_face[f]);
  return interface_distance(now, groups);
}

SurfaceDistance FitTarget::interface_distance(const TriangleMesh& fitted, std::span<const Index> groups) const {
  // All pairs of regions share so many samples: if there are many pairs, each of them has fewer.
  constexpr std::size_t kMostInterfaceSamples = 500'000, kLeastPairSamples = 500;
  const Index num_groups = groups.empty() ? 0 : *std::ranges::max_element(groups);
  const TrianglesByGroup of_fitted(fitted, groups), of_target(interfaces, group_of_interface_triangle);
  SurfaceDistanceOptions options;
  const std::size_t of_pair =
      std::max(kLeastPairSamples, kMostInterfaceSamples / static_cast<std::size_t>(std::max(num_groups, 1)));
  options.num_samples = std::min(options.num_samples, static_cast<int>(of_pair));
  SurfaceDistance largest;
  for (Index group = 1; group <= num_groups; ++group) {
    const TriangleMesh a = of_fitted.part(group), b = of_target.part(group);
    if (a.triangles.empty() || b.triangles.empty()) continue;
    const SurfaceDistance distance = surface_distance(a, b, options);
    largest.mean_a_to_b = std::max(largest.mean_a_to_b, distance.mean_a_to_b);
    largest.mean_b_to_a = std::max(largest.mean_b_to_a, distance.mean_b_to_a);
    if (distance.max_a_to_b.distance > largest.max_a_to_b.distance) largest.max_a_to_b = distance.max_a_to_b;
    if (distance.max_b_to_a.distance > largest.max_b_to_a.distance) largest.max_b_to_a = distance.max_b_to_a;
  }
  return largest;
}

std::vector<Index> groups_of_sheets(const VolumeMesh& mesh, const MeshTopology& topology) {
  const Interfaces interfaces = find_interfaces(mesh, topology);
  if (interfaces.empty()) return {};
  std::vector<Index> groups(topology.num_faces(), kNoIndex);
  for (const Index f : topology.boundary_faces()) groups[f] = 0;
  for (std::size_t i = 0; i < interfaces.faces.size(); ++i)
    groups[interfaces.faces[i]] = 1 + interfaces.pair_of_face[i];
  return groups;
}

std::vector<Index> groups_of_triangles(std::span<const Index> faces, std::span<const Index> group_of_face) {
  std::vector<Index> groups;
  if (group_of_face.empty()) return groups;
  for (const Index f : faces) groups.push_back(group_of_face[f]);
  return groups;
}

void FitTarget::sample(std::size_t num_samples, std::size_t least, std::size_t most) {
  const double count = static_cast<double>(std::max(num_samples, least));
  // The second bound keeps a needle of almost no area from being cut along its length endlessly.
  surface.resample(std::max(1.8 * std::sqrt(surface.area() / count), 0.1 / std::sqrt(count)));
  surface.thin(most);
}

SurfaceDistance FitTarget::distance(const TriangleMesh& fitted, bool extremes) const {
  return distance(fitted, ClosestPoint(fitted), extremes);
}

SurfaceDistance FitTarget::distance(const TriangleMesh& fitted, const ClosestPoint& fitted_tree, bool extremes) const {
  return tree ? surface_distance(fitted, fitted_tree, mesh, *tree, {.extremes = extremes})
              : surface_distance(fitted_tree, surface.samples());
}

StartComparison FitTarget::compare_start(const TriangleMesh& boundary) {
  const SurfaceDistance start = distance(boundary);
  if (surface.volume_source() == VolumeSource::isoperimetric)
    if (const double volume = signed_volume(boundary.positions, boundary.triangles); volume > 0)
      surface.set_volume(volume);
  std::optional<TargetSurface> outer;  // interfaces are no part of what the boundary is compared with
  if (!region_triangle.empty()) outer.emplace(mesh);
  StartComparison result{start.mean(), start.max(), describe_target(outer ? *outer : surface, boundary)};
  const double unit = std::pow(normalization.diagonal, 2);
  result.target.area *= unit;
  result.target.volume *= unit * normalization.diagonal;
  return result;
}

}  // namespace subvol::internal
