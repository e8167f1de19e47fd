// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/shell/ray_gap.h"

#include "subvol/base/error.h"

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>

#include <limits>
#include <string>

namespace subvol::internal {
namespace {

// With exact predicates, a ray through an edge or a corner does not slip between triangles.
using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Triangles = std::vector<Kernel::Triangle_3>;
using Primitive = CGAL::AABB_triangle_primitive<Kernel, Triangles::const_iterator>;
using Tree = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>>;

Kernel::Point_3 point(const Vec3& p) { return {p[0], p[1], p[2]}; }

}  // namespace

std::vector<double> ray_gaps(const TriangleMesh& surface, std::span<const Vec3> directions) {
  if (directions.size() != surface.positions.size())
    throw InputError("ray_gaps: expected one direction per vertex (" + std::to_string(surface.positions.size()) +
                     "), got " + std::to_string(directions.size()));
  std::vector<double> gaps(directions.size(), std::numeric_limits<double>::infinity());
  if (surface.triangles.size() < 2) return gaps;  // a tree of a single triangle ignores the filter
  Triangles triangles;
  for (const auto& [a, b, c] : surface.triangles)
    triangles.emplace_back(point(surface.positions[a]), point(surface.positions[b]), point(surface.positions[c]));
  Tree tree(triangles.cbegin(), triangles.cend());
  tree.build();
#pragma omp parallel for schedule(dynamic, 64)
  for (std::size_t v = 0; v < gaps.size(); ++v) {
    const Vec3 &from = surface.positions[v], to = from + directions[v];
    const auto holds_vertex = [&](Triangles::const_iterator it) {
      const auto& triangle = surface.triangles[static_cast<std::size_t>(it - triangles.cbegin())];
      return triangle[0] == static_cast<Index>(v) || triangle[1] == static_cast<Index>(v) ||
             triangle[2] == static_cast<Index>(v);
    };
    const auto hit = tree.first_intersection(Kernel::Ray_3(point(from), point(to)), holds_vertex);
    if (!hit) continue;
    if (const auto* p = boost::get<Kernel::Point_3>(&hit->first))
      gaps[v] = (Vec3(p->x(), p->y(), p->z()) - from).norm();
  }
  return gaps;
}

}  // namespace subvol::internal
