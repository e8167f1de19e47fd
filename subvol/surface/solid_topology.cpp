// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/surface/solid_topology.h"

#include "subvol/base/error.h"
#include "subvol/surface/corner_fans.h"
#include "subvol/surface/crowded_edges.h"
#include "subvol/surface/orientation.h"
#include "subvol/surface/part_nesting.h"
#include "subvol/surface/rim_loops.h"
#include "subvol/surface/triangle_geometry.h"
#include "subvol/surface/welded_surface.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace subvol {

using namespace internal;

namespace {

/// The sides of one or two triangles at an edge of the surface. Where solids touch along an edge, each has its own.
struct SurfaceEdge {
  SurfaceHalfEdge first;
  std::optional<SurfaceHalfEdge> second;
};

/// Returns the edges of a surface. names: vertex numbers for messages. InputError: an edge of more than two triangles
/// that are not those of solids that touch there.
std::vector<SurfaceEdge> edges_of(const TriangleMesh& mesh, std::span<const Index> names) {
  const bool outward = signed_volume_of(mesh) >= 0;
  std::vector<SurfaceEdge> edges;
  std::vector<std::array<std::size_t, 2>> pairs;
  CrowdedEdges crowded;
  const auto name = [&](Index v) { return vertex_text(names[v], &mesh.positions[v]); };
  const std::vector<SurfaceHalfEdge> sides = sorted_half_edges(mesh.triangles, mesh.positions.size());
  for_each_edge(std::span(sides), [&](std::span<const SurfaceHalfEdge> run) {
    if (run.size() == 1)
      edges.push_back({run[0], std::nullopt});
    else if (run.size() == 2)
      edges.push_back({run[0], run[1]});
    else if (pair_around_edge(mesh, run, outward, pairs))
      for (const auto& [i, j] : pairs) edges.push_back({run[i], run[j]});
    else
      crowded.add(name(run[0].low), name(run[0].high), run.size());
  });
  if (!crowded.empty()) throw InputError("surface: it bounds no solid unless it is wrapped: " + crowded.text());
  return edges;
}

/// Returns the neighbors across the edges of each triangle, in no particular order. names: vertex numbers for messages.
std::vector<std::vector<TriangleNeighbor>> neighbors_of(const TriangleMesh& mesh, std::span<const Index> names) {
  std::vector<std::vector<TriangleNeighbor>> neighbors(mesh.triangles.size());
  for (const auto& [first, second] : edges_of(mesh, names)) {
    if (!second) continue;
    const bool disagrees = first.forward == second->forward;
    neighbors[first.triangle].push_back({second->triangle, disagrees});
    neighbors[second->triangle].push_back({first.triangle, disagrees});
  }
  return neighbors;
}

/// Flips triangles to agree with their neighbors; the majority of a component stays as it is. Returns the component of
/// each triangle, or -1 for a triangle without neighbors.
std::vector<int> orient(TriangleMesh& mesh, std::span<const Index> names, SolidBoundary& result) {
  OrientedParts parts = orient_parts(mesh, neighbors_of(mesh, names));
  if (parts.not_oriented != kNoIndex)
    throw InputError("surface: it cannot be oriented (around triangle " + std::to_string(parts.not_oriented) + ")");
  result.flipped_triangles += parts.turned;
  return std::move(parts.part);
}

/// Drops the triangles that belong to no component.
void drop_loners(TriangleMesh& mesh, std::vector<int>& component, SolidBoundary& result) {
  std::size_t kept = 0;
  for (std::size_t t = 0; t < component.size(); ++t) {
    if (component[t] < 0) continue;
    mesh.triangles[kept] = mesh.triangles[t];
    if (!mesh.face_groups.empty()) mesh.face_groups.of_face[kept] = mesh.face_groups.of_face[t];
    component[kept++] = component[t];
  }
  result.dropped_triangles += component.size() - kept;
  mesh.triangles.resize(kept);
  if (!mesh.face_groups.empty()) mesh.face_groups.of_face.resize(kept);
  component.resize(kept);
}

/// Closes every hole by a fan around the mean of its rim's vertices.
void close_holes(TriangleMesh& mesh, std::vector<int>& component, SolidBoundary& result) {
  for (const std::vector<RimEdge>& loop : rim_loops(mesh)) {
    Vec3 mean = Vec3::Zero();
    for (const RimEdge& edge : loop) mean += mesh.positions[edge.from];
    const auto center = static_cast<Index>(mesh.positions.size());
    mesh.positions.push_back(mean / static_cast<double>(loop.size()));
    for (const RimEdge& edge : loop) {
      mesh.triangles.push_back({edge.to, edge.from, center});
      component.push_back(component[edge.triangle]);
      if (!mesh.face_groups.empty()) mesh.face_groups.of_face.push_back(kNoIndex);
    }
    ++result.closed_holes;
  }
}

/// Returns vertices - edges + triangles of each component; each fan at a vertex counts as a vertex of its own.
std::vector<int> euler_numbers(const TriangleMesh& mesh, std::span<const int> component, int count,
                               std::span<const Index> names) {
  std::vector<int> euler(static_cast<std::size_t>(count), 0);
  CornerFans fans(mesh.triangles);
  for (const auto& [first, second] : edges_of(mesh, names)) {
    --euler[component[first.triangle]];
    if (second) fans.join(first, *second);
  }
  for (std::size_t c = 0; c < fans.num_corners(); ++c)
    if (fans.of(c) == static_cast<Index>(c)) ++euler[component[c / 3]];
  for (int c : component) ++euler[c];
  return euler;
}

}  // namespace

std::string to_string(const BettiNumbers& numbers) {
  const auto counted = [](int n, const char* one, const char* many) {
    return std::to_string(n) + ' ' + (n == 1 ? one : many);
  };
  return counted(numbers.components, "component", "components") + ", " + counted(numbers.handles, "handle", "handles") +
         ", " + counted(numbers.cavities, "cavity", "cavities");
}

SolidBoundary solid_boundary(const TriangleMesh& surface) {
  SolidBoundary result;
  WeldedSurface input = welded(surface);
  result.dropped_triangles = input.dropped;
  TriangleMesh& mesh = input.mesh;
  std::vector<Index>& names = input.vertex_numbers;
  std::vector<int> component = orient(mesh, names, result);
  drop_loners(mesh, component, result);
  if (mesh.triangles.empty()) throw InputError("surface: it has no triangles that share an edge");
  close_holes(mesh, component, result);
  names.resize(mesh.positions.size(), kNoIndex);  // centers of holes have no number
  const int count = *std::max_element(component.begin(), component.end()) + 1;
  const PartNesting parts = part_nesting(mesh, component, count);
  const std::vector<int> euler = euler_numbers(mesh, component, count, names);
  for (std::size_t c = 0; c < euler.size(); ++c) {
    ++(parts.is_void(c) ? result.topology.cavities : result.topology.components);
    result.topology.handles += (2 - euler[c]) / 2;
    result.volume += parts.is_void(c) ? -std::abs(parts.volumes[c]) : std::abs(parts.volumes[c]);
  }
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    if (!parts.faces_out(static_cast<std::size_t>(component[t]))) std::swap(mesh.triangles[t][1], mesh.triangles[t][2]);
  // A surface with a volume below kFlatSolidVolumeShare area^(3/2) is flat up to rounding.
  double area = 0;
  for (const auto& t : mesh.triangles) area += triangle_area(mesh, t);
  constexpr double kFlatSolidVolumeShare = 1e-6;
  if (!(result.volume > kFlatSolidVolumeShare * area * std::sqrt(area)))
    throw InputError("surface: it encloses no volume");
  result.surface = std::move(mesh);
  return result;
}

}  // namespace subvol
