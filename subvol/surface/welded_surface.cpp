// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/surface/welded_surface.h"

#include "subvol/base/disjoint_sets.h"
#include "subvol/base/error.h"
#include "subvol/surface/triangle_geometry.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <tuple>
#include <utility>

namespace subvol::internal {

namespace {

constexpr double kSameAngle = 1e-9;  // radians; beyond the rounding of angles between vertices of any usual numbers

Index third_corner(const TriangleMesh& mesh, const SurfaceHalfEdge& side) {
  const auto& t = mesh.triangles[side.triangle];
  return t[0] + t[1] + t[2] - side.low - side.high;
}

/// Returns, for each of these vertices, the smallest number of one of them in the same place; kNoIndex for the others.
std::vector<Index> first_in_place(std::span<const Vec3> positions, std::span<const char> used) {
  std::vector<Index> order;
  for (std::size_t v = 0; v < used.size(); ++v)
    if (used[v]) order.push_back(static_cast<Index>(v));
  const auto compared = [&](Index a, Index b) {
    const Vec3 &p = positions[a], &q = positions[b];
    for (int i = 0; i < 3; ++i)
      if (p[i] != q[i]) return p[i] < q[i] ? -1 : 1;
    return 0;
  };
  std::sort(order.begin(), order.end(), [&](Index a, Index b) {
    const int c = compared(a, b);
    return c != 0 ? c < 0 : a < b;
  });
  std::vector<Index> first(used.size(), kNoIndex);
  for (std::size_t i = 0; i < order.size(); ++i)
    first[order[i]] = i > 0 && compared(order[i - 1], order[i]) == 0 ? first[order[i - 1]] : order[i];
  return first;
}

/// Returns the same for all vertices that are corners of a triangle.
std::vector<Index> first_in_place(const TriangleMesh& surface) {
  std::vector<char> used(surface.positions.size(), 0);
  for (const auto& t : surface.triangles)
    for (Index v : t) {
      if (v < 0 || static_cast<std::size_t>(v) >= used.size() || !surface.positions[v].allFinite())
        throw InputError("surface: a triangle names a vertex that is not there, or whose position is not finite");
      used[v] = 1;
    }
  return first_in_place(surface.positions, used);
}

}  // namespace

TriangleMesh joined_at_open_edges(TriangleMesh surface) {
  const std::size_t num_vertices = surface.positions.size();
  std::vector<std::array<Index, 3>> proper;  // with three different corners
  for (const auto& t : surface.triangles) {
    for (const Index v : t)
      if (v < 0 || static_cast<std::size_t>(v) >= num_vertices) return surface;
    if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) proper.push_back(t);
  }
  std::vector<char> is_open(num_vertices, 0);
  for_each_edge(sorted_half_edges(proper, num_vertices), [&](std::span<const SurfaceHalfEdge> sides) {
    if (sides.size() == 1) is_open[sides[0].low] = is_open[sides[0].high] = 1;
  });
  for (std::size_t v = 0; v < num_vertices; ++v)
    if (!surface.positions[v].allFinite()) is_open[v] = 0;
  const std::vector<Index> first = first_in_place(surface.positions, is_open);
  for (auto& t : surface.triangles)
    for (Index& v : t)
      if (first[v] != kNoIndex) v = first[v];
  return surface;
}

WeldedSurface welded(const TriangleMesh& surface) {
  const std::vector<Index> first = first_in_place(surface);
  const std::vector<Index>& groups = surface.face_groups.of_face;
  WeldedSurface result;
  result.mesh.face_groups.groups = surface.face_groups.groups;
  std::vector<Index> number(surface.positions.size(), kNoIndex);
  const auto vertex = [&](Index v) {
    Index& n = number[first[v]];
    if (n == kNoIndex) {
      n = static_cast<Index>(result.mesh.positions.size());
      result.mesh.positions.push_back(surface.positions[v]);
      result.vertex_numbers.push_back(first[v]);
    }
    return n;
  };
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    const auto& [a, b, c] = surface.triangles[t];
    const std::array<Index, 3> corners{vertex(a), vertex(b), vertex(c)};
    if (corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0]) {
      ++result.dropped;
    } else {
      result.mesh.triangles.push_back(corners);
      result.triangle_numbers.push_back(static_cast<Index>(t));
      if (!groups.empty()) result.mesh.face_groups.of_face.push_back(groups[t]);
    }
  }
  return result;
}

std::vector<Index> drop_copies(TriangleMesh& mesh) {
  std::vector<std::pair<std::array<Index, 3>, Index>> keys;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    auto key = mesh.triangles[t];
    std::sort(key.begin(), key.end());
    keys.push_back({key, static_cast<Index>(t)});
  }
  std::sort(keys.begin(), keys.end());
  std::vector<Index> kept_as(mesh.triangles.size(), kNoIndex);  // at first the number of the first copy
  for (std::size_t i = 0; i < keys.size(); ++i)
    kept_as[keys[i].second] =
        i > 0 && keys[i].first == keys[i - 1].first ? kept_as[keys[i - 1].second] : keys[i].second;
  std::size_t kept = 0;
  for (std::size_t t = 0; t < kept_as.size(); ++t) {
    if (std::cmp_not_equal(kept_as[t], t)) {
      kept_as[t] = kept_as[kept_as[t]];
      continue;
    }
    kept_as[t] = static_cast<Index>(kept);
    mesh.triangles[kept] = mesh.triangles[t];
    if (!mesh.face_groups.empty()) mesh.face_groups.of_face[kept] = mesh.face_groups.of_face[t];
    ++kept;
  }
  mesh.triangles.resize(kept);
  if (!mesh.face_groups.empty()) mesh.face_groups.of_face.resize(kept);
  return kept_as;
}

std::vector<SurfaceHalfEdge> sorted_half_edges(std::span<const std::array<Index, 3>> triangles,
                                               std::size_t num_vertices) {
  std::vector<std::size_t> begin(num_vertices + 1, 0);
  const auto for_each_side = [&](auto&& visit) {
    for (std::size_t t = 0; t < triangles.size(); ++t)
      for (std::size_t e = 0; e < 3; ++e) {
        const Index v = triangles[t][e], w = triangles[t][(e + 1) % 3];
        visit(SurfaceHalfEdge{std::min(v, w), std::max(v, w), static_cast<Index>(t), v < w});
      }
  };
  for_each_side([&](const SurfaceHalfEdge& side) { ++begin[static_cast<std::size_t>(side.low) + 1]; });
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  std::vector<SurfaceHalfEdge> sides(3 * triangles.size());
  std::vector<std::size_t> end(begin.begin(), begin.end() - 1);
  for_each_side([&](const SurfaceHalfEdge& side) { sides[end[side.low]++] = side; });
  for (std::size_t v = 0; v < num_vertices; ++v)
    std::sort(sides.begin() + static_cast<std::ptrdiff_t>(begin[v]),
              sides.begin() + static_cast<std::ptrdiff_t>(begin[v + 1]),
              [](const SurfaceHalfEdge& a, const SurfaceHalfEdge& b) {
                return std::tie(a.high, a.triangle) < std::tie(b.high, b.triangle);
              });
  return sides;
}

std::vector<std::pair<double, std::size_t>> sorted_around_edge(const TriangleMesh& mesh,
                                                               std::span<const SurfaceHalfEdge> sides) {
  const Vec3& from = mesh.positions[sides[0].low];
  const Vec3 along = (mesh.positions[sides[0].high] - from).normalized();
  const Vec3 x = along.unitOrthogonal(), y = along.cross(x);
  std::vector<std::pair<double, std::size_t>> order;
  for (std::size_t i = 0; i < sides.size(); ++i) {
    const Vec3 across = mesh.positions[third_corner(mesh, sides[i])] - from;
    order.emplace_back(std::atan2(across.dot(y), across.dot(x)), i);
  }
  std::sort(order.begin(), order.end());
  return order;
}

std::vector<std::array<Index, 2>> contacts_at_edge(const TriangleMesh& mesh, std::span<const SurfaceHalfEdge> sides) {
  std::vector<std::array<Index, 2>> contacts;
  if (sides.size() < 3) return contacts;
  const Vec3& from = mesh.positions[sides[0].low];
  const Vec3 edge = mesh.positions[sides[0].high] - from;
  const auto has_area = [&](const SurfaceHalfEdge& side) {  // otherwise the angle means nothing
    const Vec3 across = mesh.positions[third_corner(mesh, side)] - from;
    return across.cross(edge).norm() > kSameAngle * edge.norm() * std::max(across.norm(), edge.norm());
  };
  const std::vector<std::pair<double, std::size_t>> order = sorted_around_edge(mesh, sides);
  for (std::size_t i = 0; i < order.size(); ++i) {
    const std::size_t next = (i + 1) % order.size();
    const double between = order[next].first - order[i].first + (next == 0 ? 2 * std::numbers::pi : 0);
    if (!(between < kSameAngle)) continue;
    const SurfaceHalfEdge &a = sides[order[i].second], &b = sides[order[next].second];
    if (third_corner(mesh, a) != third_corner(mesh, b) && has_area(a) && has_area(b))
      contacts.push_back({std::min(a.triangle, b.triangle), std::max(a.triangle, b.triangle)});
  }
  return contacts;
}

bool pair_around_edge(const TriangleMesh& mesh, std::span<const SurfaceHalfEdge> sides, bool outward,
                      std::vector<std::array<std::size_t, 2>>& pairs) {
  pairs.clear();
  if (sides.size() % 2 != 0) return false;
  std::vector<std::pair<double, std::size_t>> order = sorted_around_edge(mesh, sides);
  // A triangle that runs forward has its normal on the side of larger angles: the solid is on the other side. Of two
  // triangles in one place, with a solid on each side, the one whose solid lies before comes first.
  for (std::size_t i = 0; i + 1 < order.size(); ++i)
    if (order[i + 1].first - order[i].first < kSameAngle && sides[order[i].second].forward != outward &&
        sides[order[i + 1].second].forward == outward)
      std::swap(order[i], order[i + 1]);
  for (std::size_t i = 0; i < order.size(); ++i) {
    const std::size_t at = order[i].second;
    if (!sides[at].forward) continue;
    const std::size_t n = order.size(), other = order[(i + (outward ? n - 1 : 1)) % n].second;
    if (sides[other].forward) return false;
    pairs.push_back({at, other});
  }
  return 2 * pairs.size() == sides.size();
}

double signed_volume_of(const TriangleMesh& mesh) {
  DisjointSets parts(mesh.positions.size());
  for (const auto& [a, b, c] : mesh.triangles) {
    parts.join(a, b);
    parts.join(a, c);
  }
  std::vector<Index> origins(mesh.positions.size(), kNoIndex);  // of the part that a vertex is the least of
  double sum = 0;
  for (const auto& t : mesh.triangles) {
    Index& first = origins[parts.of(t[0])];
    if (first == kNoIndex) first = t[0];
    sum += sixfold_volume(mesh.positions, t, mesh.positions[first]);
  }
  return sum / 6;
}

}  // namespace subvol::internal
