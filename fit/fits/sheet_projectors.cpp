// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/fits/sheet_projectors.h"

#include "subvol/mesh/face_groups.h"
#include "subvol/mesh/interfaces.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <span>
#include <utility>

namespace subvol::internal {

namespace {

constexpr double kMostFlatDeviation = 1e-7;  ///< distance from a plane or a line, as a share of the size
constexpr double kSameNormalSine = 1e-5;     ///< of the angle between normals

/// The directions that a node may not move in: the sum of n n^T over unit vectors n.
struct Barred {
  Mat3 sum = Mat3::Zero();
  bool all = false;

  void add(const Barred& other) {
    sum += other.sum;
    all = all || other.all;
  }
  Mat3 projector() const {
    if (all) return Mat3::Zero();
    const Eigen::SelfAdjointEigenSolver<Mat3> solver(sum);
    Mat3 result = Mat3::Zero();
    for (int i = 0; i < 3; ++i) {
      const Vec3 direction = solver.eigenvectors().col(i);
      if (solver.eigenvalues()[i] < kSameNormalSine * kSameNormalSine) result += direction * direction.transpose();
    }
    return result;
  }
};

/// Finds the directions that are barred to the nodes of each vertex, edge and face.
class SheetBars {
 public:
  SheetBars(const HighOrderMesh& mesh, const VolumeMesh& labels)
      : mesh_(mesh),
        topology_(mesh.space.topology()),
        vertices_(topology_.num_vertices()),
        edges_(topology_.num_edges()),
        faces_(topology_.num_faces()),
        kinds_(topology_.num_edges()) {
    const Interfaces interfaces = find_interfaces(labels, topology_);
    for (const Index f : topology_.boundary_faces())
      add_face(f, {group_of(labels.face_groups, topology_.face(f)), kNoIndex});
    for (std::size_t k = 0; k < interfaces.faces.size(); ++k) {
      const Index f = interfaces.faces[k];
      add_face(f, {group_of(labels.face_groups, topology_.face(f)), interfaces.pair_of_face[k]});
    }
    for (const Index e : borders_) add_border(e);
  }

  std::vector<Mat3> projectors(bool fixed) const {
    std::vector<Mat3> result(mesh_.space.num_nodes(), Mat3::Identity());
    const auto set = [&](std::size_t begin, std::size_t end, const std::optional<Barred>& barred) {
      if (!barred) return;
      const Mat3 projector = fixed ? Mat3(Mat3::Zero()) : barred->projector();
      std::fill(result.begin() + static_cast<std::ptrdiff_t>(begin), result.begin() + static_cast<std::ptrdiff_t>(end),
                projector);
    };
    for (std::size_t v = 0; v < vertices_.size(); ++v) set(v, v + 1, vertices_[v]);
    for (std::size_t e = 0; e < edges_.size(); ++e)
      set(mesh_.space.edge_nodes(e), mesh_.space.edge_nodes(e + 1), edges_[e]);
    for (std::size_t f = 0; f < faces_.size(); ++f)
      set(mesh_.space.face_nodes(f), mesh_.space.face_nodes(f + 1), faces_[f]);
    return result;
  }

 private:
  using FaceKind = std::pair<Index, Index>;  ///< group and interface

  std::span<const Vec3> modes(std::size_t begin, std::size_t end) const {
    return std::span(mesh_.coefficients).subspan(begin, end - begin);
  }

  void add_face(Index f, const FaceKind& kind) {
    const std::span<const Index> corners = topology_.face(f);
    Barred barred;
    if (const std::optional<Vec3> normal = plane_normal(f))
      barred.sum = *normal * normal->transpose();
    else
      barred.all = true;
    add(faces_[f], barred);
    for (std::size_t k = 0; k < corners.size(); ++k) {
      add(vertices_[corners[k]], barred);
      const Index e = topology_.find_edge(corners[k], corners[(k + 1) % corners.size()]);
      add(edges_[e], barred);
      if (kinds_[e] && *kinds_[e] != kind) borders_.push_back(e);
      kinds_[e] = kind;
    }
  }

  void add_border(Index e) {
    const auto [v, w] = topology_.edge(e);
    const Vec3 chord = mesh_.coefficients[w] - mesh_.coefficients[v];
    const double length = chord.norm();
    Barred barred;
    barred.all = !(length > 0) ||
                 std::ranges::any_of(
                     modes(mesh_.space.edge_nodes(e), mesh_.space.edge_nodes(e + 1)),
                     [&](const Vec3& mode) { return mode.cross(chord).norm() > kMostFlatDeviation * length * length; });
    if (!barred.all) barred.sum = Mat3::Identity() - chord * chord.transpose() / (length * length);
    add(edges_[e], barred);
    add(vertices_[v], barred);
    add(vertices_[w], barred);
  }

  /// Returns the unit normal of a face that is flat.
  std::optional<Vec3> plane_normal(Index f) const {
    const std::span<const Index> corners = topology_.face(f);
    const auto at = [&](std::size_t k) { return mesh_.coefficients[corners[k]]; };
    const Vec3 diagonal = at(corners.size() - 1) - at(1);
    const Vec3 area = (at(2) - at(0)).cross(corners.size() == 4 ? diagonal : Vec3(at(2) - at(1)));
    const double size = std::sqrt(area.norm());
    if (!(size > 0)) return {};
    const Vec3 normal = area / area.norm();
    const auto lies_in_plane = [&](const Vec3& offset) {
      return std::abs(normal.dot(offset)) <= kMostFlatDeviation * size;
    };
    const auto all_lie = [&](std::size_t begin, std::size_t end) {
      return std::ranges::all_of(modes(begin, end), lies_in_plane);
    };
    for (std::size_t k = 0; k < corners.size(); ++k) {
      const Index e = topology_.find_edge(corners[k], corners[(k + 1) % corners.size()]);
      if (!lies_in_plane(at(k) - at(0)) || !all_lie(mesh_.space.edge_nodes(e), mesh_.space.edge_nodes(e + 1)))
        return {};
    }
    if (!all_lie(mesh_.space.face_nodes(f), mesh_.space.face_nodes(f + 1))) return {};
    return normal;
  }

  static void add(std::optional<Barred>& to, const Barred& barred) {
    if (!to) to.emplace();
    to->add(barred);
  }

  const HighOrderMesh& mesh_;
  const MeshTopology& topology_;
  std::vector<std::optional<Barred>> vertices_, edges_, faces_;  ///< nothing: not on a sheet
  std::vector<std::optional<FaceKind>> kinds_;                   ///< of the last face that was added at each edge
  std::vector<Index> borders_;
};

}  // namespace

std::vector<Mat3> sheet_projectors(const HighOrderMesh& mesh, const VolumeMesh& labels, bool fixed) {
  return SheetBars(mesh, labels).projectors(fixed);
}

}  // namespace subvol::internal
