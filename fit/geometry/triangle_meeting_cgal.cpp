// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/geometry/triangle_meeting.h"

#include <CGAL/Exact_predicates_exact_constructions_kernel.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <utility>
#include <vector>

namespace subvol::internal {

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using ExactKernel = CGAL::Exact_predicates_exact_constructions_kernel;
using Corners = std::array<Vec3, 3>;

Kernel::Point_3 point(const Vec3& p) { return {p[0], p[1], p[2]}; }

/// Side of a triangle's plane on which each corner of another one lies: -1, 0 or 1, exactly.
struct Sides {
  std::array<int, 3> of{};
  int num_on_plane = 0;
  bool straddles = false;  ///< corners lie strictly on both sides

  Sides(const Corners& plane, const Corners& corners) {
    bool above = false, below = false;
    for (std::size_t i = 0; i < 3; ++i) {
      of[i] = static_cast<int>(CGAL::orientation(point(plane[0]), point(plane[1]), point(plane[2]), point(corners[i])));
      num_on_plane += of[i] == 0;
      above |= of[i] > 0;
      below |= of[i] < 0;
    }
    straddles = above && below;
  }
};

/// True if a line along an edge of `a` has `a` on one side and no corner of `b` strictly on that side: the triangles,
/// which lie in one plane, do not overlap.
bool separated_by_edge(const Corners& a, const Corners& b) {
  for (std::size_t e = 0; e < 3; ++e) {
    const auto p = point(a[e]), q = point(a[(e + 1) % 3]), r = point(a[(e + 2) % 3]);
    if (std::none_of(b.begin(), b.end(),
                     [&](const Vec3& s) { return CGAL::coplanar_orientation(p, q, r, point(s)) == CGAL::POSITIVE; }))
      return true;
  }
  return false;
}

/// True if the point of a triangle's plane that is closest to p lies in the triangle, up to rounding.
bool is_over(const Corners& t, const Vec3& p) {
  constexpr double kOverTriangleSlack = -1e-9;  // share of the triangle's height
  const Vec3 normal = (t[1] - t[0]).cross(t[2] - t[0]);
  for (std::size_t e = 0; e < 3; ++e)
    if (normal.dot((t[(e + 1) % 3] - t[e]).cross(p - t[e])) < kOverTriangleSlack * normal.squaredNorm()) return false;
  return true;
}

/// Adds the points at which the edges of `a` reach the plane of `b` inside `b`.
void add_places(const Corners& a, const Sides& sides, const Corners& b, std::vector<Vec3>& places) {
  const Vec3 normal = (b[1] - b[0]).cross(b[2] - b[0]).normalized();
  for (std::size_t e = 0; e < 3; ++e) {
    const std::size_t f = (e + 1) % 3;
    if (sides.of[e] == 0 && is_over(b, a[e])) places.push_back(a[e]);
    if (sides.of[e] * sides.of[f] >= 0) continue;
    const double from = normal.dot(a[e] - b[0]), to = normal.dot(a[f] - b[0]);
    const double share = from != to ? std::clamp(from / (from - to), 0.0, 1.0) : 0.5;
    const Vec3 p = a[e] + share * (a[f] - a[e]);
    if (is_over(b, p)) places.push_back(p);
  }
}

/// Adds the points at which edges of two triangles in one plane cross.
void add_crossings(const Corners& a, const Corners& b, std::vector<Vec3>& places) {
  const Vec3 normal = (a[1] - a[0]).cross(a[2] - a[0]);
  for (std::size_t e = 0; e < 3; ++e)
    for (std::size_t f = 0; f < 3; ++f) {
      const Vec3 u = a[(e + 1) % 3] - a[e], v = b[(f + 1) % 3] - b[f], w = b[f] - a[e];
      const double det = normal.dot(u.cross(v));
      if (det == 0) continue;
      const double s = normal.dot(w.cross(v)) / det, t = normal.dot(w.cross(u)) / det;
      if (s >= 0 && s <= 1 && t >= 0 && t <= 1) places.push_back(a[e] + s * u);
    }
}

/// True if two triangles, each of which straddles the other's plane, have only the crossing of two edges in common.
bool meet_at_edges_only(const Corners& a, const Corners& b) {
  for (std::size_t e = 0; e < 3; ++e)
    for (std::size_t f = 0; f < 3; ++f) {
      const Vec3 &p = a[e], &q = a[(e + 1) % 3], &r = b[f], &s = b[(f + 1) % 3];
      if (CGAL::orientation(point(p), point(q), point(r), point(s)) != CGAL::COPLANAR) continue;
      // Two edges in one plane may cross. Their crossing is all that the triangles share, or the end of a stretch.
      const auto triangle = [](const Corners& t) {
        const auto exact = [](const Vec3& x) { return ExactKernel::Point_3(x[0], x[1], x[2]); };
        return ExactKernel::Triangle_3(exact(t[0]), exact(t[1]), exact(t[2]));
      };
      const auto common = CGAL::intersection(triangle(a), triangle(b));
      return common && boost::get<ExactKernel::Point_3>(&*common) != nullptr;
    }
  return false;
}

MeetingKind kind_of(const Corners& a, const Corners& b, const Sides& of_a, const Sides& of_b) {
  if (of_a.num_on_plane == 3 || of_b.num_on_plane == 3)
    return separated_by_edge(a, b) || separated_by_edge(b, a) ? MeetingKind::edge : MeetingKind::face;
  if (of_a.straddles && of_b.straddles) return meet_at_edges_only(a, b) ? MeetingKind::vertex : MeetingKind::crossing;
  const bool by_edge = (!of_a.straddles && of_a.num_on_plane == 2) || (!of_b.straddles && of_b.num_on_plane == 2);
  return by_edge ? MeetingKind::edge : MeetingKind::vertex;
}

}  // namespace

TriangleMeeting meeting_of(const Corners& a, const Corners& b) {
  const Sides of_a(b, a), of_b(a, b);
  std::vector<Vec3> places;
  add_places(a, of_a, b, places);
  add_places(b, of_b, a, places);
  if (of_a.num_on_plane == 3) add_crossings(a, b, places);
  if (places.empty()) places = {a[0], a[1], a[2], b[0], b[1], b[2]};
  Vec3 sum = Vec3::Zero();
  for (const Vec3& p : places) sum += p;
  return {kind_of(a, b, of_a, of_b), sum / static_cast<double>(places.size())};
}

}  // namespace subvol::internal
