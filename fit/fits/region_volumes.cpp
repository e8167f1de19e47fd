// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/fits/region_volumes.h"

#include "subvol/base/dense_solve.h"
#include "subvol/fit/quality/quality.h"
#include "subvol/fit/quality/region_quality.h"
#include "subvol/mesh/interfaces.h"
#include "subvol/mesh/mesh_topology.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

namespace subvol::internal {

namespace {

/// A face of a sheet; the normal points out of the first region.
struct SheetFace {
  std::array<Index, 4> corners;
  std::size_t size;
  Index behind, front;  ///< places of the regions; kNoIndex: outside
};

std::vector<SheetFace> sheet_faces(const VolumeMesh& mesh, const MeshTopology& topology) {
  const std::vector<int> references = region_references(mesh);
  const auto place = [&](Index cell) {
    const int reference = mesh.references.empty() ? 0 : mesh.references[cell];
    return static_cast<Index>(std::ranges::lower_bound(references, reference) - references.begin());
  };
  std::vector<SheetFace> faces;
  const auto add = [&](Index f) {
    const auto corners = topology.face(f);
    const auto [first, second] = topology.face_cells(f);
    SheetFace face{{}, corners.size(), place(first), second == kNoIndex ? kNoIndex : place(second)};
    std::ranges::copy(corners, face.corners.begin());
    faces.push_back(face);
  };
  for (const Index f : topology.boundary_faces()) add(f);
  for (const Index f : find_interfaces(mesh, topology).faces) add(f);
  return faces;
}

/// The area vector of a face, and of each of its corners the gradient of the volume behind the face.
struct FaceGradients {
  Vec3 area = Vec3::Zero();
  std::array<Vec3, 4> of_corner;
  bool is_flat;
};

FaceGradients gradients_of(const SheetFace& face, std::span<const Vec3> x) {
  constexpr double kFlatFaceRounding = 1e-9;  // share of the face's radius up to which it is flat
  // The volume below a fan around the mean of the corners, as `region_volumes` measures it.
  FaceGradients result;
  result.of_corner.fill(Vec3::Zero());
  Vec3 center = Vec3::Zero(), of_center = Vec3::Zero();
  const auto count = static_cast<double>(face.size);
  for (std::size_t i = 0; i < face.size; ++i) center += x[face.corners[i]] / count;
  double out_of_plane = 0, largest = 0;
  for (std::size_t i = 0; i < face.size; ++i) {
    const std::size_t next = (i + 1) % face.size;
    const Vec3 &a = x[face.corners[i]], &b = x[face.corners[next]];
    result.area += 0.5 * (a - center).cross(b - center);
    of_center += a.cross(b) / 6;
    result.of_corner[i] += b.cross(center) / 6;
    result.of_corner[next] += center.cross(a) / 6;
    largest = std::max(largest, (a - center).norm());
  }
  for (std::size_t i = 0; i < face.size; ++i) {
    result.of_corner[i] += of_center / count;
    out_of_plane = std::max(out_of_plane, std::abs((x[face.corners[i]] - center).dot(result.area.normalized())));
  }
  result.is_flat = out_of_plane <= kFlatFaceRounding * largest;
  return result;
}

/// Takes a direction out of those in which a vertex may move.
void forbid(Mat3& projector, const Vec3& normal) {
  // Sine of 3 degrees: normals closer than that to those forbidden before are not independent of them.
  constexpr double kLeastIndependentNormalSine = 0.05;
  const Vec3 left = projector * normal;
  if (left.norm() < kLeastIndependentNormalSine) return;
  projector -= left * left.transpose() / left.squaredNorm();
}

/// The regions on either side of a face, with the sign of its area vector as seen from them.
std::array<std::pair<Index, double>, 2> regions_of(const SheetFace& face) {
  return {{{face.behind, 1.0}, {face.front, -1.0}}};
}

/// Returns for each vertex the directions in which it may move: not across flat faces.
std::vector<Mat3> projectors_of(std::span<const SheetFace> faces, const VolumeMesh& mesh) {
  std::vector<Mat3> projectors(mesh.num_vertices(), Mat3::Identity());
  for (const SheetFace& face : faces)
    if (const FaceGradients gradients = gradients_of(face, mesh.positions); gradients.is_flat)
      for (std::size_t i = 0; i < face.size; ++i) forbid(projectors[face.corners[i]], gradients.area.normalized());
  return projectors;
}

/// Gradients of the volumes of regions by vertex, of few regions at each, and the area around each vertex.
struct VertexGradients {
  std::vector<std::vector<std::pair<Index, Vec3>>> by_vertex;
  std::vector<double> area;

  VertexGradients(std::span<const SheetFace> faces, const VolumeMesh& mesh)
      : by_vertex(mesh.num_vertices()), area(mesh.num_vertices(), 0.0) {
    for (const SheetFace& face : faces) {
      const FaceGradients gradients = gradients_of(face, mesh.positions);
      for (std::size_t i = 0; i < face.size; ++i)
        area[face.corners[i]] += gradients.area.norm() / static_cast<double>(face.size);
      for (const auto& [region, sign] : regions_of(face)) {
        if (region == kNoIndex) continue;
        for (std::size_t i = 0; i < face.size; ++i) {
          auto& list = by_vertex[face.corners[i]];
          const auto at = std::ranges::find(list, region, &std::pair<Index, Vec3>::first);
          if (at == list.end())
            list.push_back({region, sign * gradients.of_corner[i]});
          else
            at->second += sign * gradients.of_corner[i];
        }
      }
    }
  }
};

/// Moves vertices so that the volumes grow by what is missing, to first order. Returns false if there is no such move.
bool move_towards(const Eigen::VectorXd& missing, std::span<const SheetFace> faces, std::span<const Mat3> projectors,
                  VolumeMesh& mesh) {
  constexpr double kMostVolumeMove = 0.2;  // of the root of the area around a vertex
  const auto [by_vertex, area] = VertexGradients(faces, mesh);
  std::vector<MatrixEntry> entries;
  for (std::size_t v = 0; v < by_vertex.size(); ++v)
    for (const auto& [r, g] : by_vertex[v])
      for (const auto& [s, h] : by_vertex[v]) entries.push_back({r, s, g.dot(projectors[v] * h) / area[v]});
  const Eigen::VectorXd factors = least_norm_solution(entries, missing);
  if (!factors.allFinite()) return false;
  for (std::size_t v = 0; v < by_vertex.size(); ++v) {
    if (by_vertex[v].empty()) continue;
    Vec3 move = Vec3::Zero();
    for (const auto& [r, g] : by_vertex[v]) move += factors[r] * g / area[v];
    move = projectors[v] * move;
    const double most = kMostVolumeMove * std::sqrt(area[v]);
    mesh.positions[v] += move.norm() > most ? Vec3(most / move.norm() * move) : move;
  }
  return true;
}

/// Returns the largest relative difference of a region's volume, and what the volumes lack.
std::pair<double, Eigen::VectorXd> volume_errors(const VolumeMesh& mesh, std::span<const double> wanted) {
  const std::vector<double> now = region_volumes(mesh);
  Eigen::VectorXd missing(static_cast<Eigen::Index>(wanted.size()));
  double largest = 0;
  for (std::size_t r = 0; r < wanted.size(); ++r) {
    missing[static_cast<Eigen::Index>(r)] = wanted[r] - now[r];
    largest = std::max(largest, std::abs(wanted[r] - now[r]) / wanted[r]);
  }
  return {largest, missing};
}

/// Moves the unknowns of a mesh so that its regions get their volumes; see `restore_volumes`. Each unknown moves as the
/// vertex of the same number would. The state with the best volumes is kept.
/// nodes   maps the unknowns to the mesh's vertices.
/// rounds  moves at most.
template <class Nodes>
bool restore_by_moves(VolumeMesh mesh, std::span<const double> wanted, double least_jacobian, int rounds,
                      const Nodes& nodes, std::vector<Vec3>& unknowns) {
  constexpr double kNegligibleVolumeError = 1e-6;  // relative
  const MeshTopology topology(mesh);
  const std::vector<SheetFace> faces = sheet_faces(mesh, topology);
  const std::vector<Vec3> before = unknowns;
  const QualityReport quality = measure_quality(mesh);
  const std::vector<Mat3> projectors = projectors_of(faces, mesh);
  std::vector<Vec3> best = unknowns;
  double least_error = std::numeric_limits<double>::infinity();
  for (int round = 0; round <= rounds; ++round) {
    const auto [error, missing] = volume_errors(mesh, wanted);
    if (!(error < least_error)) break;
    least_error = error;
    best = unknowns;
    const std::vector<Vec3> start = mesh.positions;
    if (error < kNegligibleVolumeError || !move_towards(missing, faces, projectors, mesh)) break;
    for (std::size_t v = 0; v < unknowns.size(); ++v) unknowns[v] += mesh.positions[v] - start[v];
    mesh.positions = nodes(unknowns);
  }
  unknowns = std::move(best);
  mesh.positions = nodes(unknowns);
  const QualityReport after = measure_quality(mesh);
  bool good = after.certificate.not_certified.size() <= quality.certificate.not_certified.size();
  for (std::size_t c = 0; c < after.cell_minima.size() && good; ++c)
    good = after.cell_minima[c] >= std::min(least_jacobian, quality.cell_minima[c] - 1e-3);
  if (!good) unknowns = before;
  return good;
}

}  // namespace

bool restore_volumes(VolumeMesh& mesh, std::span<const double> wanted, double least_jacobian) {
  constexpr int kMostMeshVolumeRounds = 6;  // of Newton's method
  return restore_by_moves(
      mesh, wanted, least_jacobian, kMostMeshVolumeRounds, [](const std::vector<Vec3>& x) { return x; },
      mesh.positions);
}

bool restore_volumes(FittedCage& cage, std::span<const double> wanted, double least_jacobian) {
  constexpr int kMostCageVolumeRounds = 12;  // they converge linearly, because the mesh does not move by d exactly
  return restore_by_moves(
      cage.mesh(), wanted, least_jacobian, kMostCageVolumeRounds,
      [&](const std::vector<Vec3>& x) { return cage.level().nodes.apply(x); }, cage.cage.positions);
}

}  // namespace subvol::internal
