// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/base/error.h"
#include "subvol/fit/geometry/hole_covers.h"
#include "subvol/surface/rim_loops.h"
#include "subvol/surface/triangle_geometry.h"
#include "subvol/surface/welded_surface.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/triangulate_hole.h>
#include <CGAL/utility.h>

#include <array>
#include <exception>
#include <iterator>
#include <vector>

namespace subvol::internal {

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;

/// Longest rim, in vertices, for which all triangulations are compared: the cost is cubic, about a second here.
constexpr std::size_t kMostCubic = 300;

/// Returns the triangles of a cover, as places in its rim; empty if there is none.
std::vector<std::array<Index, 3>> cover(const std::vector<Kernel::Point_3>& rim) {
  using Triangle = CGAL::Triple<Index, Index, Index>;
  std::vector<Triangle> found;
  try {
    CGAL::Polygon_mesh_processing::triangulate_hole_polyline(
        rim, std::back_inserter(found),
        CGAL::parameters::use_delaunay_triangulation(true).do_not_use_cubic_algorithm(rim.size() > kMostCubic));
  } catch (const std::exception&) {  // an assertion inside CGAL
    return {};
  }
  std::vector<std::array<Index, 3>> triangles;
  for (const Triangle& t : found) triangles.push_back({t.first, t.second, t.third});
  return triangles;
}

/// Twice the area of the triangles from one on.
double doubled_area(const TriangleMesh& mesh, std::size_t first) {
  double sum = 0;
  for (std::size_t t = first; t < mesh.triangles.size(); ++t)
    sum += doubled_area_vector(mesh, mesh.triangles[t]).norm();
  return sum;
}

}  // namespace

std::optional<CoveredHoles> cover_holes(const TriangleMesh& surface) {
  CoveredHoles result{.surface = welded(surface).mesh};
  TriangleMesh& mesh = result.surface;
  std::vector<std::vector<RimEdge>> loops;
  try {
    loops = rim_loops(mesh);
  } catch (const InputError&) {
    return std::nullopt;
  }
  const std::size_t first = mesh.triangles.size();
  for (const std::vector<RimEdge>& loop : loops) {
    std::vector<Kernel::Point_3> rim;
    std::vector<Index> vertices;
    for (std::size_t i = loop.size(); i-- > 0;) {  // a cover runs along the rim the other way than the surface does
      vertices.push_back(loop[i].to);
      const Vec3& p = mesh.positions[vertices.back()];
      rim.emplace_back(p.x(), p.y(), p.z());
    }
    const std::vector<std::array<Index, 3>> triangles = cover(rim);
    if (triangles.empty()) return std::nullopt;
    for (const auto& [i, j, k] : triangles) {
      mesh.triangles.push_back({vertices[i], vertices[j], vertices[k]});
      if (!mesh.face_groups.empty()) mesh.face_groups.of_face.push_back(kNoIndex);
    }
    ++result.count;
  }
  if (result.count == 0) return std::nullopt;
  const double all = doubled_area(mesh, 0), covers = doubled_area(mesh, first);
  result.area_share = covers / (all - covers);
  return result;
}

}  // namespace subvol::internal
