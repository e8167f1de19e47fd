// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/features/crisp_edges.h"

#include "subvol/base/angle.h"
#include "subvol/base/disjoint_sets.h"
#include "subvol/base/format.h"
#include "subvol/surface/triangle_geometry.h"
#include "subvol/surface/welded_surface.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

namespace subvol::internal {

namespace {

/// The angles between the triangles of a surface, and its planes.
class Bends {
 public:
  Bends(const TriangleMesh& mesh, const FeatureCurves& curves) {
    std::vector<std::array<Index, 3>> triangles;
    std::vector<Vec3> normals;
    for (const auto& triangle : mesh.triangles) {
      const auto& [a, b, c] = triangle;
      if (a == b || b == c || c == a) continue;
      const Vec3 doubled_area = doubled_area_vector(mesh, triangle);
      areas_.push_back(doubled_area.norm() / 2);
      normals.push_back(doubled_area.normalized());
      triangles.push_back(triangle);
      for (const Index v : triangle) box_.extend(mesh.positions[v]);
    }
    sides_ = sorted_half_edges(triangles, mesh.positions.size());
    edges_of_.resize(triangles.size());
    std::vector<int> num_edges(triangles.size(), 0);
    for_each_edge(sides_, [&](std::span<const SurfaceHalfEdge> sides) {
      for (const SurfaceHalfEdge& side : sides)
        edges_of_[side.triangle][num_edges[side.triangle]++] = static_cast<Index>(edges_.size());
      edges_.push_back({sides, sides.size() == 2 ? angle_between(sides[0], sides[1], normals) : 0, false});
    });
    find_planes(normals);
    for (const FeatureCurve& curve : curves.curves)
      for (std::size_t i = 0; i + 1 < curve.vertices.size(); ++i)
        if (const Index e = find(curve.vertices[i], curve.vertices[i + 1]); e != kNoIndex) edges_[e].on_curve = true;
  }

  double area() const { return std::accumulate(areas_.begin(), areas_.end(), 0.0); }

  /// Returns true if a plane of the surface ends at an edge. Edges between two planes count as well.
  bool bounds_plane(Index v, Index w) const {
    const Index edge = find(v, w);
    return edge != kNoIndex && std::ranges::any_of(edges_[edge].sides, [&](const SurfaceHalfEdge& side) {
             return in_plane_[side.triangle];
           });
  }

  bool is_crisp(Index v, Index w) const {
    // The edges around a crisp edge bend less than this share of its angle.
    constexpr double kMostNeighborBendShare = 1.0 / 3;
    const Index edge = find(v, w);
    if (edge == kNoIndex) return false;
    double others = 0;
    for (const SurfaceHalfEdge& side : edges_[edge].sides)
      for (const Index e : edges_of_[side.triangle])
        if (!edges_[e].on_curve) others = std::max(others, edges_[e].angle);
    return others < kMostNeighborBendShare * edges_[edge].angle;
  }

 private:
  struct Edge {
    std::span<const SurfaceHalfEdge> sides;
    double angle;  ///< between its two triangles, in degrees; 0 if there are not two
    bool on_curve;
  };

  /// Marks the triangles of planes: connected triangles, two or more, whose normals are those of the largest one.
  void find_planes(std::span<const Vec3> normals) {
    constexpr double kMostPlaneNormalAngle = 0.5;  // degrees; normals of coordinates in single precision differ by less
    constexpr double kLeastArea = 1e-4;            // share of the squared diagonal
    std::vector<Index> by_area(areas_.size());
    std::iota(by_area.begin(), by_area.end(), Index{0});
    std::ranges::stable_sort(by_area, std::greater(), [&](Index t) { return areas_[t]; });
    in_plane_.assign(areas_.size(), false);
    std::vector<bool> visited(areas_.size(), false);
    std::vector<Index> patch;
    for (const Index seed : by_area) {
      if (visited[seed]) continue;
      visited[seed] = true;
      patch = {seed};
      double area = 0;
      for (std::size_t i = 0; i < patch.size(); ++i) {
        area += areas_[patch[i]];
        for (const Index e : edges_of_[patch[i]])
          for (const SurfaceHalfEdge& side : edges_[e].sides) {
            const double angle = angle_degrees_between(normals[seed], normals[side.triangle]);
            if (visited[side.triangle] || std::min(angle, 180 - angle) > kMostPlaneNormalAngle) continue;
            visited[side.triangle] = true;
            patch.push_back(side.triangle);
          }
      }
      if (patch.size() < 2 || area <= kLeastArea * box_.diagonal().squaredNorm()) continue;
      for (const Index t : patch) in_plane_[t] = true;
    }
  }

  /// Returns the angle between two triangles, whatever their orientation.
  static double angle_between(const SurfaceHalfEdge& a, const SurfaceHalfEdge& b, std::span<const Vec3> normals) {
    const double sign = a.forward == b.forward ? -1 : 1;
    return angle_degrees_between(normals[a.triangle], sign * normals[b.triangle]);
  }

  /// Returns the number of an edge; kNoIndex if no triangle has it.
  Index find(Index v, Index w) const {
    const std::pair<Index, Index> ends = std::minmax(v, w);
    const auto at = std::ranges::lower_bound(
        edges_, ends, {}, [](const Edge& edge) { return std::pair(edge.sides.front().low, edge.sides.front().high); });
    const bool found =
        at != edges_.end() && at->sides.front().low == ends.first && at->sides.front().high == ends.second;
    return found ? static_cast<Index>(at - edges_.begin()) : kNoIndex;
  }

  std::vector<SurfaceHalfEdge> sides_;
  std::vector<Edge> edges_;                     ///< ascending by their ends
  std::vector<std::array<Index, 3>> edges_of_;  ///< of each triangle that is no sliver with two equal corners
  std::vector<double> areas_;                   ///< of those triangles
  std::vector<bool> in_plane_;                  ///< for those triangles
  Eigen::AlignedBox3d box_;
};

/// Diagonals of the bounding boxes of the parts of a surface that triangles connect.
class PartDiagonals {
 public:
  explicit PartDiagonals(const TriangleMesh& mesh) : parts_(mesh.positions.size()), boxes_(mesh.positions.size()) {
    for (const auto& [a, b, c] : mesh.triangles) {
      parts_.join(a, b);
      parts_.join(b, c);
    }
    for (const auto& t : mesh.triangles)
      for (const Index v : t) boxes_[parts_.of(v)].extend(mesh.positions[v]);
  }
  /// Returns the diagonal of the part to which a vertex belongs. The vertex must be a corner of a triangle.
  double at(Index vertex) { return boxes_[parts_.of(vertex)].diagonal().norm(); }

 private:
  DisjointSets parts_;
  std::vector<Eigen::AlignedBox3d> boxes_;
};

}  // namespace

EdgeCrispness edge_crispness(const TriangleMesh& mesh, const FeatureCurves& curves) {
  constexpr double kLongCurveShare = 0.03;       // of the diagonal
  constexpr double kLeastCrispCurveShare = 0.5;  // of a curve's length
  EdgeCrispness result;
  if (curves.empty()) return result;
  const Bends bends(mesh, curves);
  PartDiagonals diagonals(mesh);
  double all = 0, crisp = 0, long_crisp = 0, planar = 0;
  for (const FeatureCurve& curve : curves.curves) {
    double crisp_here = 0;
    for (std::size_t i = 0; i + 1 < curve.vertices.size(); ++i) {
      const double length = (curve.points[i + 1] - curve.points[i]).norm();
      if (bends.is_crisp(curve.vertices[i], curve.vertices[i + 1])) crisp_here += length;
      if (bends.bounds_plane(curve.vertices[i], curve.vertices[i + 1])) planar += length;
    }
    const double length = curve.length();
    all += length;
    crisp += crisp_here;
    if (length > kLongCurveShare * diagonals.at(curve.vertices[0]) && crisp_here > kLeastCrispCurveShare * length)
      long_crisp += length;
  }
  if (all > 0) {
    result.crisp_share = crisp / all;
    result.planar_share = planar / all;
  }
  if (const double area = bends.area(); area > 0) {
    result.relative_length = long_crisp / std::sqrt(area);
    result.relative_planar_length = planar / std::sqrt(area);
  }
  return result;
}

EdgeDecision decide_about_edges(const TriangleMesh& mesh, std::optional<double> angle_degrees, bool follows_all_edges) {
  constexpr double kNotableEdgeLength = 0.3;  // relative length that is worth a warning
  if (!angle_degrees) return {};
  const FeatureCurves curves = feature_curves(mesh, *angle_degrees);
  if (follows_all_edges || curves.empty()) return {!curves.empty(), {}};
  const EdgeCrispness crispness = edge_crispness(mesh, curves);
  if (crispness.is_designed()) return {true, {}};
  if (std::max(crispness.relative_length, crispness.relative_planar_length) < kNotableEdgeLength) return {};
  double length = 0;
  Eigen::AlignedBox3d box;
  for (const auto& triangle : mesh.triangles)
    for (const Index v : triangle) box.extend(mesh.positions[v]);
  for (const FeatureCurve& curve : curves.curves) length += curve.length();
  return {false,
          formatted("the target is taken for a scan or a sculpture, because the faces beside its sharp edges are bent "
                    "as well: %zu curves above %g degrees (%.3g %% of the diagonal in all) are not followed; they are "
                    "if a crease angle is given (--crease-angle %g)",
                    curves.curves.size(), *angle_degrees, 100 * length / box.diagonal().norm(), *angle_degrees)};
}

bool has_edges_to_follow(const TriangleMesh& mesh, std::optional<double> angle_degrees, bool follows_all_edges) {
  return decide_about_edges(mesh, angle_degrees, follows_all_edges).follows;
}

}  // namespace subvol::internal
