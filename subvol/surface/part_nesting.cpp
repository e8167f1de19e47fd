// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/surface/part_nesting.h"

#include "subvol/surface/triangle_geometry.h"
#include "subvol/surface/winding_number.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <utility>

namespace subvol::internal {

namespace {

/// Finds out if one of many boxes contains a given box: a tree with the largest box of each branch at its root.
class BoxTree {
 public:
  explicit BoxTree(std::vector<Eigen::AlignedBox3d> boxes) : boxes_(std::move(boxes)), hulls_(boxes_.size()) {
    arrange(0, boxes_.size());
  }
  /// Returns true if a box other than this one contains it. Of equal boxes each contains the others.
  bool holds(const Eigen::AlignedBox3d& box) const { return count(0, boxes_.size(), box) > 1; }

 private:
  /// A branch holds the boxes first .. last - 1: its root at `first`, and two branches of half of the others each.
  /// Returns the place where the second one begins.
  static std::size_t middle(std::size_t first, std::size_t last) { return first + 1 + (last - first - 1) / 2; }

  void arrange(std::size_t first, std::size_t last) {
    if (first == last) return;
    const auto at = [&](std::size_t i) { return boxes_.begin() + static_cast<std::ptrdiff_t>(i); };
    for (std::size_t i = first; i < last; ++i) hulls_[first].extend(boxes_[i]);
    std::iter_swap(at(first), std::max_element(at(first), at(last), [](const auto& a, const auto& b) {
      return a.diagonal().maxCoeff() < b.diagonal().maxCoeff();
    }));
    int axis = 0;
    hulls_[first].diagonal().maxCoeff(&axis);
    const std::size_t half = middle(first, last);
    std::nth_element(at(first + 1), at(half), at(last),
                     [&](const auto& a, const auto& b) { return a.min()[axis] < b.min()[axis]; });
    arrange(first + 1, half);
    arrange(half, last);
  }
  /// Returns the number of boxes that contain a box, or 2 if there are more.
  int count(std::size_t first, std::size_t last, const Eigen::AlignedBox3d& box) const {
    if (first == last || !hulls_[first].contains(box)) return 0;
    const std::size_t half = middle(first, last);
    int found = boxes_[first].contains(box) ? 1 : 0;
    if (found < 2) found += count(first + 1, half, box);
    if (found < 2) found += count(half, last, box);
    return std::min(found, 2);
  }

  std::vector<Eigen::AlignedBox3d> boxes_;
  std::vector<Eigen::AlignedBox3d> hulls_;  ///< bounding box of the branch that begins at each place
};

constexpr std::size_t kTriangles = 16;   // triangles of a part whose corners and centers are asked for
constexpr double kClearlyWhole = 0.2;    // farthest from a whole number: ten times the error of two winding numbers

/// The triangles of each part.
struct Parts {
  Parts(const TriangleMesh& surface, std::span<const int> part, int count)
      : mesh(surface), triangles(static_cast<std::size_t>(count)), boxes(static_cast<std::size_t>(count)) {
    for (std::size_t t = 0; t < part.size(); ++t) {
      triangles[part[t]].push_back(static_cast<Index>(t));
      for (Index v : mesh.triangles[t]) boxes[part[t]].extend(mesh.positions[v]);
    }
  }
  double volume(std::size_t p) const {
    const Vec3 origin = mesh.positions[mesh.triangles[triangles[p].front()][0]];
    double sum = 0;
    for (Index t : triangles[p]) sum += sixfold_volume(mesh.positions, mesh.triangles[t], origin);
    return sum / 6;
  }
  /// Returns a part's surface, turned outward.
  TriangleMesh outward(std::size_t p, double volume) const {
    TriangleMesh result;
    for (Index t : triangles[p]) {
      const auto first = static_cast<Index>(result.positions.size());
      for (Index v : mesh.triangles[t]) result.positions.push_back(mesh.positions[v]);
      result.triangles.push_back({first, first + 1, first + 2});
      if (volume < 0) std::swap(result.triangles.back()[1], result.triangles.back()[2]);
    }
    return result;
  }
  /// Returns centers and corners of triangles, evenly spread over the part's list.
  std::vector<Vec3> points(std::size_t p) const {
    std::vector<Vec3> result;
    const std::size_t n = triangles[p].size(), wanted = std::min(n, kTriangles);
    for (std::size_t i = 0; i < wanted; ++i) {
      const auto& [a, b, c] = mesh.triangles[triangles[p][i * n / wanted]];
      for (const Index v : {a, b, c}) result.push_back(mesh.positions[v]);
      result.emplace_back((mesh.positions[a] + mesh.positions[b] + mesh.positions[c]) / 3);
    }
    return result;
  }

  const TriangleMesh& mesh;
  std::vector<std::vector<Index>> triangles;
  std::vector<Eigen::AlignedBox3d> boxes;
};

/// Returns the least of the whole numbers near some values, or of all of them rounded if none is near one; >= 0. The
/// value of a point on another part's surface lies in the middle of two and is rounded up: such a part lies in the
/// other.
int least_whole(std::span<const double> values) {
  constexpr double kError = 0.02;  // of two winding numbers
  double clear = -1, any = -1;
  for (const double value : values) {
    const double whole = std::max(0.0, std::round(value)), upper = std::max(0.0, std::round(value + kError));
    if (any < 0 || upper < any) any = upper;
    if (std::abs(value - whole) <= kClearlyWhole && (clear < 0 || whole < clear)) clear = whole;
  }
  return static_cast<int>(std::max(0.0, clear >= 0 ? clear : any));
}

}  // namespace

PartNesting part_nesting(const TriangleMesh& mesh, std::span<const int> part, int count) {
  const Parts parts(mesh, part, count);
  PartNesting nesting;
  nesting.depths.assign(parts.triangles.size(), 0);
  for (std::size_t p = 0; p < parts.triangles.size(); ++p) nesting.volumes.push_back(parts.volume(p));
  const BoxTree tree(parts.boxes);
  std::vector<std::size_t> inner;
  for (std::size_t p = 0; p < parts.triangles.size(); ++p)
    if (tree.holds(parts.boxes[p])) inner.push_back(p);
  if (inner.empty()) return nesting;
  TriangleMesh all = mesh;
  for (std::size_t t = 0; t < part.size(); ++t)
    if (nesting.volumes[part[t]] < 0) std::swap(all.triangles[t][1], all.triangles[t][2]);
  const WindingNumber around(all);
  for (const std::size_t p : inner) {
    const std::vector<Vec3> points = parts.points(p);
    const WindingNumber own(parts.outward(p, nesting.volumes[p]));
    std::vector<double> depths;
    for (const Vec3& x : points) depths.push_back(around.at(x) - own.at(x));
    nesting.depths[p] = least_whole(depths);
  }
  return nesting;
}

int part_around(const TriangleMesh& mesh, std::span<const int> part, const PartNesting& nesting, int inner) {
  const Parts parts(mesh, part, static_cast<int>(nesting.depths.size()));
  const auto self = static_cast<std::size_t>(inner);
  int best = -1;
  for (std::size_t p = 0; p < parts.boxes.size(); ++p) {
    if (p == self || !parts.boxes[p].contains(parts.boxes[self])) continue;
    if (best >= 0 && std::abs(nesting.volumes[p]) >= std::abs(nesting.volumes[best])) continue;
    const WindingNumber winding(parts.outward(p, nesting.volumes[p]));
    if (least_whole(winding.at(parts.points(self))) > 0) best = static_cast<int>(p);
  }
  return best;
}

}  // namespace subvol::internal
