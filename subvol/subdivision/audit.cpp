// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/subdivision/audit.h"

#include "subvol/base/disjoint_sets.h"
#include "subvol/base/sort_unique.h"
#include "subvol/subdivision/surface_refinement.h"
#include "subvol/surface/sheets.h"
#include "subvol/surface/triangle_geometry.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace subvol {

using namespace internal;

namespace {

constexpr double kStraightAngleSlack = std::numbers::pi / 180;  // one degree: angles this close to straight are noise

void find_nonmanifold(const MeshTopology& topology, SubdivisionAudit& result) {
  std::vector<int> counts(topology.num_edges(), 0);
  std::vector<Index> corner_vertices;
  std::vector<std::array<Index, 2>> edge_corners(topology.num_edges());  // a corner at either end of an edge
  std::size_t num_corners = 0;
  for (Index f : topology.boundary_faces()) num_corners += topology.face(f).size();
  DisjointSets fans(num_corners);  // of the corners at a vertex, joined across edges
  for (Index f : topology.boundary_faces()) {
    const auto face = topology.face(f);
    const std::size_t first = corner_vertices.size(), n = face.size();
    corner_vertices.insert(corner_vertices.end(), face.begin(), face.end());
    for (std::size_t i = 0; i < n; ++i) {
      std::array<Index, 2> ends = {static_cast<Index>(first + i), static_cast<Index>(first + (i + 1) % n)};
      if (face[i] > face[(i + 1) % n]) std::swap(ends[0], ends[1]);
      const Index e = topology.find_edge(face[i], face[(i + 1) % n]);
      if (counts[e]++ == 0) {
        edge_corners[e] = ends;
      } else {
        fans.join(edge_corners[e][0], ends[0]);
        fans.join(edge_corners[e][1], ends[1]);
      }
    }
  }
  for (std::size_t e = 0; e < counts.size(); ++e) {
    result.num_boundary_edges += counts[e] > 0;
    if (counts[e] > 0 && counts[e] != 2) result.nonmanifold_edges.push_back(topology.edge(static_cast<Index>(e)));
  }
  std::vector<int> fan_counts(topology.num_vertices(), 0);
  for (Index h = 0; h < static_cast<Index>(num_corners); ++h) fan_counts[corner_vertices[h]] += fans.of(h) == h;
  for (std::size_t v = 0; v < fan_counts.size(); ++v)
    if (fan_counts[v] > 1) result.nonmanifold_vertices.push_back(static_cast<Index>(v));
  std::sort(result.nonmanifold_edges.begin(), result.nonmanifold_edges.end());
}

void find_flattened(const VolumeMesh& mesh, const MeshTopology& topology, SubdivisionAudit& result) {
  std::vector<char> sharp(topology.num_edges(), 0);
  for (const CreaseEdge& crease : mesh.tags.creases) {
    const Index e = topology.find_edge(crease.v0, crease.v1);
    if (e != kNoIndex) sharp[e] = 1;
  }
  const InterfaceMarks interfaces = mark_interfaces(topology, find_interfaces(mesh, topology));
  // Of the two regions at a smooth edge of an interface, the number of cells of the first cell's, and of the other.
  std::vector<std::array<int, 2>> counts(interfaces.edges.size(), {0, 0});
  std::vector<int> first(interfaces.edges.size(), 0);
  for (std::size_t c = 0; c < mesh.num_cells() && !counts.empty(); ++c)
    for (const Index e : topology.cell_edges(c)) {
      if (counts[e][0] == 0) first[e] = mesh.references[c];
      ++counts[e][mesh.references[c] != first[e]];
    }
  for (std::size_t i = 0; i < topology.num_edges(); ++i) {
    const Index e = static_cast<Index>(i);
    if (sharp[i] || interfaces.is_curve(e)) continue;
    const bool of_boundary = topology.is_boundary_edge(e) && topology.num_edge_cells(e) == 1;
    const bool of_interface = interfaces.has_edge(e) && std::min(counts[i][0], counts[i][1]) == 1;
    result.num_interface_edges += interfaces.has_edge(e);
    if (of_boundary || of_interface) result.flattened_edges.push_back(topology.edge(e));
  }
  std::sort(result.flattened_edges.begin(), result.flattened_edges.end());
}

Vec3 face_normal(const SurfaceTopology& surface, Index f, std::span<const Vec3> points) {
  return doubled_area_vector(points, surface.face(f)).normalized();
}

bool is_reflex(const SurfaceTopology& surface, Index e, std::span<const Vec3> points) {
  const Index h = surface.edge_corners[e];
  const Vec3 along = points[surface.corner_vertices[surface.next(h)]] - points[surface.corner_vertices[h]];
  const Vec3 left = face_normal(surface, surface.corner_faces[h], points);
  const Vec3 right = face_normal(surface, surface.corner_faces[surface.twins[h]], points);
  return left.cross(right).dot(along.normalized()) < -std::sin(kStraightAngleSlack);
}

double corner_angle(const SurfaceTopology& surface, Index h, std::span<const Vec3> points) {
  const Vec3& p = points[surface.corner_vertices[h]];
  const Vec3 a = points[surface.corner_vertices[surface.next(h)]] - p;
  const Vec3 b = points[surface.corner_vertices[surface.prev(h)]] - p;
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

/// Returns the smooth edges within spans of more than half a turn between two creases around a fixed vertex.
std::vector<Index> folding_edges(const SurfaceTopology& surface, Index v, std::span<const Vec3> points) {
  const auto edge = [&](Index h) { return surface.corner_edges[h]; };
  const auto sharp = [&](Index h) { return surface.edge_sharpness[edge(h)] > 0; };
  const Index first = surface.vertex_corners[v];
  Index start = first;  // of an open fan, the edge of the first corner is sharp
  while (!sharp(start)) {
    start = surface.rotate(start);
    if (start == first) return {};
  }
  std::vector<Index> folding;
  Index h = start;
  do {
    double span = corner_angle(surface, h, points);
    std::vector<Index> inside;
    for (h = surface.rotate(h); h != kNoIndex && !sharp(h); h = surface.rotate(h)) {
      span += corner_angle(surface, h, points);
      inside.push_back(edge(h));
    }
    if (span > std::numbers::pi + kStraightAngleSlack) folding.insert(folding.end(), inside.begin(), inside.end());
  } while (h != start && h != kNoIndex);
  return folding;
}

void find_reflex(const VolumeMesh& mesh, const MeshTopology& topology, SubdivisionAudit& result) {
  const SheetSurface sheets = tagged_sheets(mesh, topology);
  const SurfaceTopology& surface = sheets.topology;
  std::vector<Vec3> points;
  for (Index v : sheets.vertices) points.push_back(mesh.positions[v]);
  for (std::size_t e = 0; e < surface.num_edges(); ++e)
    if (topology.is_boundary_edge(sheets.edges[e]) && surface.edge_sharpness[e] > 0 &&
        surface.twins[surface.edge_corners[e]] != kNoIndex && is_reflex(surface, static_cast<Index>(e), points))
      result.reflex_creases.push_back(topology.edge(sheets.edges[e]));
  std::sort(result.reflex_creases.begin(), result.reflex_creases.end());
  for (std::size_t i = 0; i < surface.num_vertices(); ++i) {
    const Index v = static_cast<Index>(i);
    if (!vertex_weights_at(surface, v, BoundaryRule::catmull_clark).fixed()) continue;
    const std::vector<Index> edges = folding_edges(surface, v, points);
    if (!edges.empty()) result.folding_corners.push_back(sheets.vertices[i]);
    for (Index e : edges) result.folding_edges.push_back(topology.edge(sheets.edges[e]));
  }
  sort_unique(result.folding_corners);
  sort_unique(result.folding_edges);
}

void warn(SubdivisionAudit& result, std::size_t count, const std::string& what) {
  if (count > 0) result.warnings.push_back(std::to_string(count) + " " + what);
}

}  // namespace

SubdivisionAudit audit(const VolumeMesh& mesh) {
  const MeshTopology topology(mesh);
  SubdivisionAudit result;
  find_nonmanifold(topology, result);
  find_flattened(mesh, topology, result);
  if (result.can_subdivide()) find_reflex(mesh, topology, result);

  warn(result, result.nonmanifold_edges.size(), "boundary edges lie between other than two boundary faces");
  warn(result, result.nonmanifold_vertices.size(), "boundary vertices have more than one fan of boundary faces");
  warn(result, result.flattened_edges.size(),
       "of " + std::to_string(result.num_boundary_edges) + " boundary edges" +
           (result.num_interface_edges > 0
                ? " and " + std::to_string(result.num_interface_edges) + " edges between regions"
                : "") +
           " are smooth and have one cell: cells flatten there with every refinement");
  warn(result, result.folding_corners.size(),
       "corners have a smooth reflex span: the subdivision surface folds there; crease the edges within the span");
  return result;
}

FeatureTags unfolding_tags(const VolumeMesh& mesh, const SubdivisionAudit& found, double sharpness) {
  FeatureTags tags = mesh.tags;
  for (const auto& [v0, v1] : found.folding_edges) tags.creases.push_back({v0, v1, sharpness});
  std::sort(tags.creases.begin(), tags.creases.end(),
            [](const CreaseEdge& a, const CreaseEdge& b) { return std::pair(a.v0, a.v1) < std::pair(b.v0, b.v1); });
  return tags;
}

}  // namespace subvol
