// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/surface/winding_number.h"

#include "subvol/base/error.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>

namespace subvol::internal {

namespace {

constexpr Index kLeafSize = 8;
// A node is taken as a whole from a distance of this many radii on: the second moments, which are left out, then add
// less than 0.01 in total.
constexpr double kFarRadii = 6;

/// Returns the signed solid angle A of a triangle seen from the origin.
///
///   tan(A/2) = det / (|a||b||c| + (a.b)|c| + (b.c)|a| + (c.a)|b|)
double solid_angle(const Vec3& a, const Vec3& b, const Vec3& c) {
  const double la = a.norm(), lb = b.norm(), lc = c.norm();
  const double numerator = a.dot(b.cross(c));
  const double denominator = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
  return numerator == 0 ? 0 : 2 * std::atan2(numerator, denominator);
}

}  // namespace

WindingNumber::WindingNumber(const TriangleMesh& mesh) {
  if (mesh.triangles.empty()) throw InputError("winding number: no triangles");
  for (const auto& t : mesh.triangles) {
    for (Index v : t)
      if (v < 0 || static_cast<std::size_t>(v) >= mesh.positions.size() || !mesh.positions[v].allFinite())
        throw InputError(
            "winding number: a triangle names a vertex that is not there, or whose position is not finite");
    unsorted_.push_back({mesh.positions[t[0]], mesh.positions[t[1]], mesh.positions[t[2]]});
  }
  std::vector<Index> order(unsorted_.size());
  std::iota(order.begin(), order.end(), 0);
  build(order, 0, static_cast<Index>(order.size()));
  corners_.reserve(order.size());
  for (Index t : order) corners_.push_back(unsorted_[t]);
  unsorted_ = {};
}

Index WindingNumber::build(std::vector<Index>& order, Index begin, Index end) {
  const auto number = static_cast<Index>(nodes_.size());
  nodes_.emplace_back();
  Node node;
  node.begin = begin;
  node.end = end;
  const auto centroid = [&](Index t) -> Vec3 { return (unsorted_[t][0] + unsorted_[t][1] + unsorted_[t][2]) / 3; };
  const auto area_vector = [&](Index t) -> Vec3 {
    return (unsorted_[t][1] - unsorted_[t][0]).cross(unsorted_[t][2] - unsorted_[t][0]) / 2;
  };
  Eigen::AlignedBox3d box;
  double area = 0;
  node.centre = node.area_vector = Vec3::Zero();
  node.moment = Mat3::Zero();
  for (Index i = begin; i < end; ++i) {
    const Vec3 c = centroid(order[i]), n = area_vector(order[i]);
    box.extend(c);
    area += n.norm();
    node.centre += n.norm() * c;
    node.area_vector += n;
  }
  node.centre = area > 0 ? Vec3(node.centre / area) : Vec3(box.center());
  for (Index i = begin; i < end; ++i) {
    node.moment += (centroid(order[i]) - node.centre) * area_vector(order[i]).transpose();
    for (const Vec3& p : unsorted_[order[i]]) node.radius = std::max(node.radius, (p - node.centre).norm());
  }
  if (end - begin > kLeafSize) {
    Index axis = 0;
    box.sizes().maxCoeff(&axis);
    const Index middle = begin + (end - begin) / 2;
    std::nth_element(order.begin() + begin, order.begin() + middle, order.begin() + end, [&](Index a, Index b) {
      const double x = centroid(a)[axis], y = centroid(b)[axis];
      return x != y ? x < y : a < b;
    });
    node.left = build(order, begin, middle);
    node.right = build(order, middle, end);
  }
  nodes_[number] = node;
  return number;
}

// A far node adds n.r/|r|^3, with r from p to its center, and the first derivative of that applied to its moment.
double WindingNumber::at(const Vec3& p) const {
  constexpr std::size_t kDeepest = 64;  // far above the depth of the tree: 2^31 triangles are halved at most 31 times
  std::array<Index, kDeepest> stack{0};
  std::size_t size = 1;
  double sum = 0;
  while (size > 0) {
    const Node& node = nodes_[stack[--size]];
    const Vec3 r = node.centre - p;
    const double distance = r.norm();
    if (distance > kFarRadii * node.radius) {
      const double cubed = distance * distance * distance;
      sum += node.area_vector.dot(r) / cubed + node.moment.trace() / cubed -
             3 * r.dot(node.moment * r) / (cubed * distance * distance);
    } else if (node.left == kNoIndex) {
      for (Index t = node.begin; t < node.end; ++t)
        sum += solid_angle(corners_[t][0] - p, corners_[t][1] - p, corners_[t][2] - p);
    } else {
      stack[size++] = node.right;
      stack[size++] = node.left;
    }
  }
  return sum / (4 * std::numbers::pi);
}

std::vector<double> WindingNumber::at(std::span<const Vec3> points) const {
  std::vector<double> result(points.size());
#pragma omp parallel for schedule(dynamic, 256)
  for (std::size_t i = 0; i < points.size(); ++i) result[i] = at(points[i]);
  return result;
}

}  // namespace subvol::internal
