// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/features/crisp_edges.h"

#include "subvol/base/disjoint_sets.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>
#include <vector>

namespace subvol::internal {

namespace {

using Edge = std::pair<Index, Index>;

/// The angles between the triangles of a surface.
class Bends {
 public:
  Bends(const TriangleMesh& mesh, const FeatureCurves& curves) : mesh_(mesh) {
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      const auto& [a, b, c] = mesh.triangles[t];
      const Vec3 area = (mesh.positions[b] - mesh.positions[a]).cross(mesh.positions[c] - mesh.positions[a]);
      area_ += area.norm() / 2;
      normals_.push_back(area.normalized());
      for (int k = 0; k < 3; ++k) triangles_of_[edge_of(t, k)].push_back(static_cast<Index>(t));
    }
    for (const FeatureCurve& curve : curves.curves)
      for (std::size_t i = 0; i + 1 < curve.vertices.size(); ++i)
        on_curves_.insert(std::minmax(curve.vertices[i], curve.vertices[i + 1]));
  }

  double area() const { return area_; }

  /// Angle between the two triangles of an edge, whatever their orientation; 0 if there are not two.
  double angle(const Edge& edge) const {
    const auto at = triangles_of_.find(edge);
    if (at == triangles_of_.end() || at->second.size() != 2) return 0;
    return std::acos(std::clamp(std::abs(normals_[at->second[0]].dot(normals_[at->second[1]])), 0.0, 1.0));
  }

  bool is_crisp(const Edge& edge) const {
    constexpr double kMostShare = 1.0 / 3;
    const auto at = triangles_of_.find(edge);
    if (at == triangles_of_.end()) return false;
    double others = 0;
    for (const Index t : at->second)
      for (int k = 0; k < 3; ++k)
        if (!on_curves_.contains(edge_of(t, k))) others = std::max(others, angle(edge_of(t, k)));
    return others < kMostShare * angle(edge);
  }

 private:
  Edge edge_of(std::size_t t, int k) const {
    return std::minmax(mesh_.triangles[t][k], mesh_.triangles[t][(k + 1) % 3]);
  }

  const TriangleMesh& mesh_;
  std::vector<Vec3> normals_;
  std::map<Edge, std::vector<Index>> triangles_of_;
  std::set<Edge> on_curves_;
  double area_ = 0;
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
  constexpr double kLong = 0.03, kMost = 0.5;
  EdgeCrispness result;
  if (curves.empty()) return result;
  const Bends bends(mesh, curves);
  PartDiagonals diagonals(mesh);
  double all = 0, crisp = 0, long_crisp = 0;
  for (const FeatureCurve& curve : curves.curves) {
    double crisp_here = 0;
    for (std::size_t i = 0; i + 1 < curve.vertices.size(); ++i)
      if (bends.is_crisp(std::minmax(curve.vertices[i], curve.vertices[i + 1])))
        crisp_here += (curve.points[i + 1] - curve.points[i]).norm();
    const double length = curve.length();
    all += length;
    crisp += crisp_here;
    if (length > kLong * diagonals.at(curve.vertices[0]) && crisp_here > kMost * length) long_crisp += length;
  }
  if (all > 0) result.crisp_share = crisp / all;
  if (bends.area() > 0) result.relative_length = long_crisp / std::sqrt(bends.area());
  return result;
}

bool has_edges_to_follow(const TriangleMesh& mesh, std::optional<double> angle_degrees, bool follows_all_edges) {
  if (!angle_degrees) return false;
  const FeatureCurves curves = feature_curves(mesh, *angle_degrees);
  return follows_all_edges ? !curves.empty() : edge_crispness(mesh, curves).is_designed();
}

}  // namespace subvol::internal
