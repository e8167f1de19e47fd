// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/features/feature_curves.h"

#include "subvol/base/angle.h"
#include "subvol/base/error.h"
#include "subvol/base/sort_unique.h"
#include "subvol/fit/features/polyline.h"
#include "subvol/surface/triangle_geometry.h"
#include "subvol/surface/welded_surface.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <tuple>

namespace subvol {

using namespace internal;

namespace {

std::array<Index, 3> sorted_corners(std::array<Index, 3> triangle) {
  std::sort(triangle.begin(), triangle.end());
  return triangle;
}

std::vector<std::array<Index, 2>> sharp_edges(const TriangleMesh& mesh, double angle_degrees) {
  std::vector<Vec3> normals;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& q = mesh.triangles[t];
    for (Index v : q)
      if (v < 0 || static_cast<std::size_t>(v) >= mesh.positions.size())
        throw InputError("feature_curves: triangle " + std::to_string(t) + " names vertex " + std::to_string(v) +
                         " of " + std::to_string(mesh.positions.size()));
    normals.push_back(triangle_normal(mesh, static_cast<Index>(t)));
  }
  std::vector<std::array<Index, 2>> sharp;
  for_each_edge(sorted_half_edges(mesh.triangles, mesh.positions.size()), [&](std::span<const SurfaceHalfEdge> sides) {
    const auto& [low, high, triangle, forward] = sides[0];
    if (sides.size() != 2 || low == high) return;
    const Vec3 left = normals[triangle];
    const Vec3 right = (forward == sides[1].forward ? -1.0 : 1.0) * normals[sides[1].triangle];
    if (angle_degrees_between(left, right) > angle_degrees) sharp.push_back({low, high});
  });
  return sharp;
}

/// Walks along sharp edges from vertex to vertex, each edge once.
class EdgeWalk {
 public:
  EdgeWalk(const TriangleMesh& mesh, std::vector<std::array<Index, 2>> edges, double angle_degrees)
      : mesh_(mesh), edges_(std::move(edges)), used_(edges_.size(), 0), corner_(mesh.positions.size(), 0) {
    offsets_.assign(mesh.positions.size() + 1, 0);
    for (const auto& edge : edges_)
      for (Index v : edge) ++offsets_[v + 1];
    for (std::size_t v = 0; v < mesh.positions.size(); ++v) offsets_[v + 1] += offsets_[v];
    around_.resize(2 * edges_.size());
    std::vector<std::size_t> next(offsets_.begin(), offsets_.end() - 1);
    for (std::size_t e = 0; e < edges_.size(); ++e)
      for (Index v : edges_[e]) around_[next[v]++] = static_cast<Index>(e);
    for (std::size_t v = 0; v < corner_.size(); ++v) corner_[v] = is_corner(static_cast<Index>(v), angle_degrees);
  }

  FeatureCurves curves() {
    FeatureCurves result;
    for (std::size_t v = 0; v < corner_.size(); ++v) {
      if (!corner_[v]) continue;
      result.corners.push_back(static_cast<Index>(v));
      result.corner_edges.push_back(static_cast<int>(edges_at(static_cast<Index>(v)).size()));
      for (Index e : edges_at(static_cast<Index>(v)))
        if (!used_[e]) result.curves.push_back(walk(static_cast<Index>(v), e));
    }
    for (std::size_t e = 0; e < edges_.size(); ++e)
      if (!used_[e]) result.curves.push_back(walk(edges_[e][0], static_cast<Index>(e)));
    return result;
  }

 private:
  std::span<const Index> edges_at(Index v) const {
    return {around_.data() + offsets_[v], offsets_[v + 1] - offsets_[v]};
  }
  Index other_end(Index e, Index v) const { return edges_[e][0] == v ? edges_[e][1] : edges_[e][0]; }

  bool is_corner(Index v, double angle_degrees) const {
    const auto edges = edges_at(v);
    if (edges.size() != 2) return !edges.empty();
    const auto& x = mesh_.positions;
    return angle_degrees_between(x[v] - x[other_end(edges[0], v)], x[other_end(edges[1], v)] - x[v]) > angle_degrees;
  }

  FeatureCurve walk(Index v, Index e) {
    FeatureCurve curve;
    curve.vertices = {v};
    while (e != kNoIndex) {
      used_[e] = 1;
      v = other_end(e, v);
      curve.vertices.push_back(v);
      e = kNoIndex;
      if (corner_[v]) break;
      for (Index candidate : edges_at(v))
        if (!used_[candidate]) e = candidate;
    }
    for (Index w : curve.vertices) curve.points.push_back(mesh_.positions[w]);
    return curve;
  }

  const TriangleMesh& mesh_;
  std::vector<std::array<Index, 2>> edges_;
  std::vector<char> used_, corner_;
  std::vector<std::size_t> offsets_;  // where each vertex begins in around_
  std::vector<Index> around_;
};

}  // namespace

std::vector<std::array<Index, 2>> group_borders(const TriangleMesh& mesh, const TriangleMesh& grouped) {
  if (grouped.face_groups.empty()) return {};
  std::vector<std::pair<std::array<Index, 3>, Index>> groups;
  for (std::size_t t = 0; t < grouped.triangles.size(); ++t)
    groups.emplace_back(sorted_corners(grouped.triangles[t]), grouped.face_groups.of_face[t]);
  std::sort(groups.begin(), groups.end());
  std::vector<std::tuple<Index, Index, Index>> sides;  // vertices, group
  for (const auto& triangle : mesh.triangles) {
    const std::array<Index, 3> corners = sorted_corners(triangle);
    const auto found = std::lower_bound(groups.begin(), groups.end(), std::pair(corners, kNoIndex));
    const Index group = found != groups.end() && found->first == corners ? found->second : kNoIndex;
    for (const auto& [low, high] : {std::pair(0, 1), std::pair(0, 2), std::pair(1, 2)})
      if (corners[low] != corners[high]) sides.emplace_back(corners[low], corners[high], group);
  }
  std::sort(sides.begin(), sides.end());
  std::vector<std::array<Index, 2>> borders;
  for (std::size_t i = 0, end = 0; i < sides.size(); i = end) {
    const auto [low, high, group] = sides[i];
    while (end < sides.size() && std::get<0>(sides[end]) == low && std::get<1>(sides[end]) == high) ++end;
    if (end - i == 2 && std::get<2>(sides[i + 1]) != group) borders.push_back({low, high});
  }
  return borders;
}

double FeatureCurve::length() const { return polyline_length(points); }

std::vector<Vec3> points_between(const FeatureCurve& curve, double from, double to) {
  std::vector<Vec3> points = curve.points;
  if (curve.closed()) points.insert(points.end(), curve.points.begin() + 1, curve.points.end());
  return ArcLength(points).part(from, to);
}

bool FeatureCurves::is_corner(Index vertex) const { return std::ranges::binary_search(corners, vertex); }

FeatureCurves feature_curves(const TriangleMesh& mesh, double angle_degrees,
                             std::span<const std::array<Index, 2>> tagged) {
  if (!(angle_degrees >= 0 && angle_degrees <= 180))
    throw InputError("feature_curves: angle_degrees must be in [0, 180], got " + std::to_string(angle_degrees));
  std::vector<std::array<Index, 2>> sharp = sharp_edges(mesh, angle_degrees);
  for (const auto& [a, b] : tagged) {
    if (std::min(a, b) < 0 || static_cast<std::size_t>(std::max(a, b)) >= mesh.positions.size() || a == b)
      throw InputError("feature_curves: a tagged edge joins vertices " + std::to_string(a) + " and " +
                       std::to_string(b) + " of " + std::to_string(mesh.positions.size()));
    sharp.push_back({std::min(a, b), std::max(a, b)});
  }
  sort_unique(sharp);
  return EdgeWalk(mesh, sharp, angle_degrees).curves();
}

}  // namespace subvol
