// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/surface/winding_number.h"

#include "subvol/base/error.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <numbers>
#include <numeric>

namespace subvol::internal {

namespace {

constexpr Index kLeafSize = 8;  // triangles
// A node is taken as a whole from a distance of this many radii on: the third moments, which are left out, then add
// less than 0.01 in total.
constexpr double kFarRadii = 2.2;

/// Adds signed solid angles A of triangles seen from the origin.
///
///   tan(A/2) = y / x,  y = det(a, b, c),  x = |a||b||c| + (a.b)|c| + (b.c)|a| + (c.a)|b|
///
/// The product of the complex numbers x + iy has the sum of the halved angles as its argument, up to full turns, which
/// are counted: one inverse tangent serves all triangles.
class SolidAngles {
 public:
  void add(const Vec3& a, const Vec3& b, const Vec3& c) {
    const double la = a.norm(), lb = b.norm(), lc = c.norm();
    const double y = a.dot(b.cross(c)), x = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
    constexpr double kSolidAngleRounding = 1e-15;                     // of the product of the lengths
    if (!(std::abs(y) > kSolidAngleRounding * la * lb * lc)) return;  // seen from its own plane: no angle
    const double length = std::abs(x) + std::abs(y);
    const std::complex<double> before = product_, factor(x / length, y / length);
    product_ = {before.real() * factor.real() - before.imag() * factor.imag(),
                before.real() * factor.imag() + before.imag() * factor.real()};
    const bool was_below = std::signbit(before.imag()), is_below = std::signbit(product_.imag());
    if (!was_below && y > 0 && is_below) ++turns_;
    if (was_below && y < 0 && !is_below) --turns_;
    product_ /= std::abs(product_.real()) + std::abs(product_.imag());
  }
  double sum() const { return 2 * (std::atan2(product_.imag(), product_.real()) + 2 * std::numbers::pi * turns_); }

 private:
  std::complex<double> product_{1, 0};
  int turns_ = 0;
};

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

/// offset  from the center to a point of a triangle.  area_vector  of the part of the triangle that it stands for.
void WindingNumber::SecondMoments::add(const Vec3& offset, const Vec3& area_vector) {
  linear += 2 * offset.dot(area_vector) * offset + offset.squaredNorm() * area_vector;
  // r -> (offset . r)^2 (area_vector . r)
  const double x = offset.x(), y = offset.y(), z = offset.z();
  const double a = area_vector.x(), b = area_vector.y(), c = area_vector.z();
  const std::array<double, 10> terms{x * x * a,
                                     x * x * b + 2 * x * y * a,
                                     x * x * c + 2 * x * z * a,
                                     y * y * a + 2 * x * y * b,
                                     2 * (y * z * a + x * z * b + x * y * c),
                                     z * z * a + 2 * x * z * c,
                                     y * y * b,
                                     y * y * c + 2 * y * z * b,
                                     z * z * b + 2 * y * z * c,
                                     z * z * c};
  for (std::size_t i = 0; i < terms.size(); ++i) cubic[i] += terms[i];
}

// Half of the second derivatives of r -> r/|r|^3, applied to the moments.
double WindingNumber::SecondMoments::at(const Vec3& r) const {
  const double x = r.x(), y = r.y(), z = r.z(), squared = r.squaredNorm();
  const double form =
      x * (x * (cubic[0] * x + cubic[1] * y + cubic[2] * z) + y * (cubic[3] * y + cubic[4] * z) + cubic[5] * z * z) +
      y * (y * (cubic[6] * y + cubic[7] * z) + cubic[8] * z * z) + cubic[9] * z * z * z;
  return (7.5 * form / squared - 1.5 * linear.dot(r)) / (squared * squared * std::sqrt(squared));
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
  node.center = node.area_vector = Vec3::Zero();
  node.moment = Mat3::Zero();
  for (Index i = begin; i < end; ++i) {
    const Vec3 c = centroid(order[i]), n = area_vector(order[i]);
    box.extend(c);
    area += n.norm();
    node.center += n.norm() * c;
    node.area_vector += n;
  }
  node.center = area > 0 ? Vec3(node.center / area) : Vec3(box.center());
  for (Index i = begin; i < end; ++i) {
    const std::array<Vec3, 3>& corners = unsorted_[order[i]];
    const Vec3 n = area_vector(order[i]);
    node.moment += (centroid(order[i]) - node.center) * n.transpose();
    for (std::size_t k = 0; k < 3; ++k) {
      node.radius = std::max(node.radius, (corners[k] - node.center).norm());
      node.second.add((corners[k] + corners[(k + 1) % 3]) / 2 - node.center, n / 3);  // exact for squares
    }
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

// A far node adds n.r/|r|^3, with r from p to its center, and the derivatives of that applied to its moments.
double WindingNumber::at(const Vec3& p) const {
  // Far above the depth of the tree: 2^31 triangles are halved at most 31 times.
  constexpr std::size_t kWindingStackSize = 64;
  std::array<Index, kWindingStackSize> stack{0};
  std::size_t size = 1;
  double sum = 0;
  SolidAngles near;
  while (size > 0) {
    const Node& node = nodes_[stack[--size]];
    const Vec3 r = node.center - p;
    const double distance = r.norm();
    if (distance > kFarRadii * node.radius) {
      const double cubed = distance * distance * distance;
      sum += node.area_vector.dot(r) / cubed + node.moment.trace() / cubed -
             3 * r.dot(node.moment * r) / (cubed * distance * distance) + node.second.at(r);
    } else if (node.left == kNoIndex) {
      for (Index t = node.begin; t < node.end; ++t)
        near.add(corners_[t][0] - p, corners_[t][1] - p, corners_[t][2] - p);
    } else {
      stack[size++] = node.right;
      stack[size++] = node.left;
    }
  }
  return (sum + near.sum()) / (4 * std::numbers::pi);
}

std::vector<double> WindingNumber::at(std::span<const Vec3> points) const {
  std::vector<double> result(points.size());
#pragma omp parallel for schedule(dynamic, 256)
  for (std::size_t i = 0; i < points.size(); ++i) result[i] = at(points[i]);
  return result;
}

}  // namespace subvol::internal
