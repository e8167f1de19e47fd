// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/templates/template_frames.h"

#include "subvol/surface/triangle_geometry.h"
#include "subvol/templates/plane_grid.h"

#include <Eigen/Dense>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <string>

namespace subvol::internal {

namespace {

struct Facet {
  Vec3 center, area_vector;
};

std::vector<Facet> facets_of(const TriangleMesh& surface) {
  std::vector<Facet> facets;
  facets.reserve(surface.triangles.size());
  for (const auto& t : surface.triangles) {
    const Vec3 &a = surface.positions[t[0]], &b = surface.positions[t[1]], &c = surface.positions[t[2]];
    facets.push_back({(a + b + c) / 3, doubled_area_vector(surface, t) / 2});
  }
  return facets;
}

Mat3 right_handed(Mat3 frame) {
  if (frame.determinant() < 0) frame.col(2) = -frame.col(2);
  return frame;
}

Mat3 principal_frame(const std::vector<Facet>& facets) {
  double area = 0;
  Vec3 mean = Vec3::Zero();
  for (const Facet& f : facets) {
    area += f.area_vector.norm();
    mean += f.area_vector.norm() * f.center;
  }
  mean /= area;
  Mat3 spread = Mat3::Zero();
  for (const Facet& f : facets) spread += f.area_vector.norm() * (f.center - mean) * (f.center - mean).transpose();
  return right_handed(Eigen::SelfAdjointEigenSolver<Mat3>(spread).eigenvectors());
}

/// Facing directions, up to sign, ordered by the area that faces them, the largest first.
std::vector<Vec3> facing_directions(const std::vector<Facet>& facets) {
  constexpr double kDirectionBinsPerUnit = 8;  // neighboring bins are about 7 degrees apart
  std::map<std::array<int, 3>, Vec3> bins;
  for (const Facet& f : facets) {
    const double area = f.area_vector.norm();
    if (!(area > 0)) continue;
    std::array<int, 3> key{};
    for (std::size_t a = 0; a < 3; ++a)
      key[a] = static_cast<int>(std::lround(kDirectionBinsPerUnit * f.area_vector[static_cast<Index>(a)] / area));
    const std::array<int, 3> opposite{-key[0], -key[1], -key[2]};
    Vec3& sum = bins.try_emplace(std::max(key, opposite), Vec3::Zero()).first->second;
    sum += key >= opposite ? f.area_vector : Vec3(-f.area_vector);
  }
  std::vector<Vec3> directions;
  for (const auto& [key, sum] : bins) directions.push_back(sum);
  std::stable_sort(directions.begin(), directions.end(),
                   [](const Vec3& a, const Vec3& b) { return a.norm() > b.norm(); });
  return directions;
}

Mat3 facing_frame(const std::vector<Facet>& facets) {
  constexpr double kPerpendicular = 0.3;  // cosine below which a second direction counts as perpendicular to the first
  const std::vector<Vec3> directions = facing_directions(facets);
  Mat3 frame;
  frame.col(0) = directions.front().normalized();
  Vec3 second = frame.col(0).unitOrthogonal();
  for (const Vec3& d : directions) {
    if (std::abs(d.normalized().dot(frame.col(0))) > kPerpendicular) continue;
    second = (d - d.dot(frame.col(0)) * frame.col(0)).normalized();
    break;
  }
  frame.col(1) = second;
  frame.col(2) = frame.col(0).cross(second);
  return frame;
}

/// True if the axes agree, in any order and direction.
bool same_axes(const Mat3& a, const Mat3& b) {
  constexpr double kSameAxesCosine = 0.999;  // cosine of 2.5 degrees
  return ((a.transpose() * b).cwiseAbs().colwise().maxCoeff().array() > kSameAxesCosine).all();
}

}  // namespace

std::vector<Mat3> template_frames(const TriangleMesh& surface) {
  const std::vector<Facet> facets = facets_of(surface);
  std::vector<Mat3> frames{Mat3::Identity()};
  for (const Mat3& frame : {principal_frame(facets), facing_frame(facets)})
    if (std::none_of(frames.begin(), frames.end(), [&](const Mat3& other) { return same_axes(frame, other); }))
      frames.push_back(frame);
  return frames;
}

Eigen::AlignedBox3d box_in(const Mat3& frame, const TriangleMesh& surface) {
  Eigen::AlignedBox3d box;
  for (const auto& t : surface.triangles)
    for (Index v : t) box.extend(Vec3(frame.transpose() * surface.positions[v]));
  return box;
}

Eigen::Array3d cells_around(const Eigen::AlignedBox3d& box, double size) {
  return (box.sizes().array() / size).ceil() + (1 + 2 * kSpareLayers);
}

VoxelGrid grid_around(const Mat3& frame, const Eigen::AlignedBox3d& box, double size, const Vec3& offset) {
  const Eigen::Array3d cells = cells_around(box, size);
  VoxelGrid grid;
  Vec3 low = box.center();
  for (int a = 0; a < 3; ++a) {
    grid.cells[static_cast<std::size_t>(a)] = static_cast<int>(cells[a]);
    low[a] -= size * (cells[a] / 2.0 + offset[a]);
  }
  grid.edges = size * frame;
  grid.origin = frame * low;
  return grid;
}

InputError too_sparse(std::size_t cells, double most) {
  return InputError("surface: a grid with " + std::to_string(cells) + " cells in its solid would have more than " +
                    std::to_string(std::lround(most)) +
                    " in all, so far apart are its parts or so thin its walls; ask for fewer, or take the parts one by "
                    "one");
}

}  // namespace subvol::internal
