// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/features/signed_features.h"

#include "subvol/base/disjoint_sets.h"
#include "subvol/base/error.h"
#include "subvol/surface/triangle_geometry.h"
#include "subvol/surface/welded_surface.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

namespace subvol::internal {

namespace {

void require_triangles(const TriangleMesh& mesh) {
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (Index v : mesh.triangles[t])
      if (v < 0 || static_cast<std::size_t>(v) >= mesh.positions.size())
        throw InputError("signed_features: triangle " + std::to_string(t) + " names vertex " + std::to_string(v) +
                         " of " + std::to_string(mesh.positions.size()));
}

std::array<Index, 2> ends_of(const SurfaceHalfEdge& side) { return {side.low, side.high}; }

std::span<const SurfaceHalfEdge> sides_at(std::span<const SurfaceHalfEdge> sides, Index v, Index w) {
  const std::array<Index, 2> ends = {std::min(v, w), std::max(v, w)};
  return {std::ranges::lower_bound(sides, ends, {}, ends_of), std::ranges::upper_bound(sides, ends, {}, ends_of)};
}

double interior_angle(const TriangleMesh& mesh, std::span<const SurfaceHalfEdge> pair) {
  const SurfaceHalfEdge &left = pair[0].forward ? pair[0] : pair[1], &right = pair[0].forward ? pair[1] : pair[0];
  const Vec3 along = mesh.positions[left.high] - mesh.positions[left.low];
  const Vec3 n0 = triangle_normal(mesh, left.triangle), n1 = triangle_normal(mesh, right.triangle);
  const Vec3 axis = n0.cross(n1);
  const double turn = std::atan2(axis.norm(), n0.dot(n1)) * 180 / std::numbers::pi;
  return axis.dot(along) >= 0 ? 180 - turn : 180 + turn;
}

std::vector<double> angles_along(const TriangleMesh& mesh, std::span<const SurfaceHalfEdge> sides,
                                 const FeatureCurve& curve) {
  std::vector<double> angles;
  for (std::size_t i = 0; i + 1 < curve.vertices.size(); ++i) {
    const Index v = curve.vertices[i], w = curve.vertices[i + 1];
    const std::span<const SurfaceHalfEdge> pair = sides_at(sides, v, w);
    if (pair.size() != 2 || pair[0].forward == pair[1].forward)
      throw InputError("signed_features: a curve runs along vertices " + std::to_string(v) + " and " +
                       std::to_string(w) + ", which is no edge of two consistently oriented triangles");
    angles.push_back(interior_angle(mesh, pair));
  }
  return angles;
}

std::vector<std::array<Index, 2>> sorted_curve_edges(const FeatureCurves& curves) {
  std::vector<std::array<Index, 2>> edges;
  for (const FeatureCurve& curve : curves.curves)
    for (std::size_t i = 0; i + 1 < curve.vertices.size(); ++i) {
      const auto [low, high] = std::minmax(curve.vertices[i], curve.vertices[i + 1]);
      edges.push_back({low, high});
    }
  std::sort(edges.begin(), edges.end());
  return edges;
}

void find_regions(const TriangleMesh& mesh, std::span<const SurfaceHalfEdge> sides, SignedFeatures& features) {
  DisjointSets sets(mesh.triangles.size());
  const auto cuts = sorted_curve_edges(features.curves);
  for_each_edge(sides, [&](std::span<const SurfaceHalfEdge> edge) {
    if (std::binary_search(cuts.begin(), cuts.end(), ends_of(edge[0]))) return;
    for (const SurfaceHalfEdge& side : edge) sets.join(edge[0].triangle, side.triangle);
  });
  features.num_regions = sets.number(features.regions);
}

/// Both regions are the same all along a curve, which ends where others meet it.
CurveSides sides_of(const FeatureCurve& curve, std::span<const SurfaceHalfEdge> sides, std::span<const Index> regions) {
  CurveSides result;
  for (const SurfaceHalfEdge& side : sides_at(sides, curve.vertices[0], curve.vertices[1])) {
    const bool runs_along = side.forward == (curve.vertices[0] < curve.vertices[1]);
    (runs_along ? result.left : result.right) = regions[side.triangle];
  }
  return result;
}

/// Length-weighted mean; the plain one if all segments are points.
double mean_of(const FeatureCurve& curve, std::span<const double> angles) {
  double sum = 0, length = 0, plain = 0;
  for (std::size_t i = 0; i < angles.size(); ++i) {
    const double l = (curve.points[i + 1] - curve.points[i]).norm();
    sum += l * angles[i];
    length += l;
    plain += angles[i] / static_cast<double>(angles.size());
  }
  return length > 0 ? sum / length : plain;
}

}  // namespace

SignedFeatures signed_features(const TriangleMesh& target, FeatureCurves curves) {
  require_triangles(target);
  const std::vector<SurfaceHalfEdge> sides = sorted_half_edges(target.triangles, target.positions.size());
  SignedFeatures features;
  features.curves = std::move(curves);
  for (const FeatureCurve& curve : features.curves.curves) {
    features.segment_angles.push_back(angles_along(target, sides, curve));
    features.angles.push_back(mean_of(curve, features.segment_angles.back()));
  }
  find_regions(target, sides, features);
  for (const FeatureCurve& curve : features.curves.curves)
    features.sides.push_back(sides_of(curve, sides, features.regions));
  return features;
}

Vec3 direction_at_end(const FeatureCurve& curve, bool from_front, double reach) {
  const std::size_t last = curve.points.size() - 1;
  const Vec3& origin = curve.points[from_front ? 0 : last];
  for (std::size_t i = 1; i <= last; ++i) {
    const Vec3 step = curve.points[from_front ? i : last - i] - origin;
    if (step.norm() > reach || i == last) return step.normalized();
  }
  return Vec3::Zero();
}

}  // namespace subvol::internal
