// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/geometry/surface_union.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/corefinement.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Surface_mesh.h>

#include <exception>
#include <vector>

namespace subvol::internal {

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Mesh = CGAL::Surface_mesh<Kernel::Point_3>;
namespace pmp = CGAL::Polygon_mesh_processing;

/// Returns nothing if the triangles do not make a closed manifold.
std::optional<Mesh> as_cgal(const TriangleMesh& surface) {
  Mesh mesh;
  std::vector<Mesh::Vertex_index> vertices;
  for (const Vec3& p : surface.positions) vertices.push_back(mesh.add_vertex({p[0], p[1], p[2]}));
  for (const auto& [a, b, c] : surface.triangles)
    if (mesh.add_face(vertices[a], vertices[b], vertices[c]) == Mesh::null_face()) return std::nullopt;
  if (!CGAL::is_closed(mesh)) return std::nullopt;
  return mesh;
}

TriangleMesh from_cgal(const Mesh& mesh) {
  TriangleMesh surface;
  std::vector<Index> number(mesh.number_of_vertices() + mesh.number_of_removed_vertices(), kNoIndex);
  for (const auto v : mesh.vertices()) {
    number[v] = static_cast<Index>(surface.positions.size());
    const auto& p = mesh.point(v);
    surface.positions.emplace_back(p.x(), p.y(), p.z());
  }
  for (const auto f : mesh.faces()) {
    const auto h = mesh.halfedge(f);
    surface.triangles.push_back({number[mesh.source(h)], number[mesh.target(h)], number[mesh.target(mesh.next(h))]});
  }
  return surface;
}

template <class Operation>
std::optional<TriangleMesh> combined(const TriangleMesh& a, const TriangleMesh& b, const Operation& operation) {
  std::optional<Mesh> first = as_cgal(a), second = as_cgal(b);
  if (!first || !second) return std::nullopt;
  try {
    Mesh result;
    if (!operation(*first, *second, result)) return std::nullopt;
    return from_cgal(result);
  } catch (const std::exception&) {  // a surface that meets itself, or an assertion inside CGAL
    return std::nullopt;
  }
}

}  // namespace

std::optional<TriangleMesh> united(const TriangleMesh& a, const TriangleMesh& b) {
  return combined(a, b, [](Mesh& first, Mesh& second, Mesh& result) {
    return pmp::corefine_and_compute_union(first, second, result, CGAL::parameters::throw_on_self_intersection(true));
  });
}

std::optional<TriangleMesh> without(const TriangleMesh& a, const TriangleMesh& b) {
  return combined(a, b, [](Mesh& first, Mesh& second, Mesh& result) {
    return pmp::corefine_and_compute_difference(first, second, result,
                                                CGAL::parameters::throw_on_self_intersection(true));
  });
}

}  // namespace subvol::internal
