// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/closest_point.h"

#include "subvol/error.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

namespace subvol {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

Vec3 closest_on_segment(const Vec3& p, const Vec3& a, const Vec3& b) {
  const Vec3 ab = b - a;
  const double length_squared = ab.squaredNorm(), t = ab.dot(p - a);
  if (t <= 0 || length_squared == 0) return a;
  return t >= length_squared ? b : Vec3(a + (t / length_squared) * ab);
}

/// Below a sine of 1e-12 the normal is rounding, and the edges are as close as the inside.
bool is_sliver(double area_squared, double ab_squared, double ac_squared) {
  return !(area_squared > 1e-24 * ab_squared * ac_squared);
}

/// Inside the triangle's prism the foot of the perpendicular, else the closest point of the edges that p lies beyond.
Vec3 closest_on_triangle(const Vec3& p, const std::array<Vec3, 3>& x) {
  const Vec3 ab = x[1] - x[0], ac = x[2] - x[0], ap = p - x[0];
  const Vec3 n = ab.cross(ac);
  const double area = n.squaredNorm();
  const double s = n.dot(ap.cross(ac)), t = n.dot(ab.cross(ap)), r = area - s - t;
  const bool sliver = is_sliver(area, ab.squaredNorm(), ac.squaredNorm());
  if (!sliver && s >= 0 && t >= 0 && r >= 0) return x[0] + (s / area) * ab + (t / area) * ac;
  Vec3 best = x[0];
  double best_squared = kInfinity;
  const auto consider = [&](int from, int to) {
    const Vec3 q = closest_on_segment(p, x[from], x[to]);
    const double squared = (p - q).squaredNorm();
    if (squared < best_squared) {
      best_squared = squared;
      best = q;
    }
  };
  if (sliver || t < 0) consider(0, 1);
  if (sliver || r < 0) consider(1, 2);
  if (sliver || s < 0) consider(2, 0);
  return best;
}

void check(const TriangleMesh& mesh) {
  if (mesh.triangles.empty()) throw InputError("closest point: the surface has no triangles");
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (const Index v : mesh.triangles[t]) {
      if (v < 0 || static_cast<std::size_t>(v) >= mesh.positions.size())
        throw InputError("closest point: triangle " + std::to_string(t) + " names vertex " + std::to_string(v) +
                         " of " + std::to_string(mesh.positions.size()));
      if (!mesh.positions[v].allFinite())
        throw InputError("closest point: vertex " + std::to_string(v) + " is not finite");
    }
}

}  // namespace

/// Halves the triangles at the median of their centres, three times per node.
struct ClosestPoint::Builder {
  ClosestPoint& tree;
  std::vector<Vec3> centres;
  struct Range {
    Index begin, end;
  };

  Range split(Range& range) {
    const auto first = tree.order_.begin() + range.begin, last = tree.order_.begin() + range.end;
    Vec3 low = Vec3::Constant(kInfinity), high = -low;
    for (auto i = first; i != last; ++i) {
      low = low.cwiseMin(centres[*i]);
      high = high.cwiseMax(centres[*i]);
    }
    int axis;
    (high - low).maxCoeff(&axis);
    const auto middle = first + (last - first) / 2;
    std::nth_element(first, middle, last, [&](Index a, Index b) {
      const double ca = centres[a][axis], cb = centres[b][axis];
      return ca != cb ? ca < cb : a < b;
    });
    const Index cut = range.begin + static_cast<Index>(middle - first);
    const Range upper{cut, range.end};
    range.end = cut;
    return upper;
  }

  void set_box(Node& node, int c, Range range) const {
    Vec3 low = Vec3::Constant(kInfinity), high = -low;
    for (Index i = range.begin; i < range.end; ++i)
      for (const Vec3& p : tree.corners_[tree.order_[i]]) {
        low = low.cwiseMin(p);
        high = high.cwiseMax(p);
      }
    for (int axis = 0; axis < 3; ++axis) {
      node.low[axis][c] = low[axis];
      node.high[axis][c] = high[axis];
    }
  }

  Index add_leaf(Range range) {
    const auto inverse = [](double x) { return x > 0 ? 1 / x : 0; };
    Leaf leaf;
    for (int lane = 0; lane < kWidth; ++lane) {
      const Index t = tree.order_[range.begin + (lane < range.end - range.begin ? lane : 0)];
      const auto& x = tree.corners_[t];
      const Vec3 ab = x[1] - x[0], ac = x[2] - x[0];
      const double area = ab.cross(ac).squaredNorm();
      for (int axis = 0; axis < 3; ++axis) {
        leaf.a[axis][lane] = x[0][axis];
        leaf.ab[axis][lane] = ab[axis];
        leaf.ac[axis][lane] = ac[axis];
      }
      leaf.inverse_ab[lane] = inverse(ab.squaredNorm());
      leaf.inverse_ac[lane] = inverse(ac.squaredNorm());
      leaf.inverse_bc[lane] = inverse((ac - ab).squaredNorm());
      leaf.inverse_area[lane] = is_sliver(area, ab.squaredNorm(), ac.squaredNorm()) ? 0 : 1 / area;
      leaf.triangle[lane] = t;
    }
    tree.leaves_.push_back(leaf);
    return static_cast<Index>(tree.leaves_.size() - 1);
  }

  Index build(Range all) {
    std::array<Range, kWidth> parts{all};
    int num_parts = 1;
    for (int round = 0; round < 3; ++round)
      for (int part = 0, existing = num_parts; part < existing; ++part)
        if (parts[part].end - parts[part].begin > kWidth) parts[num_parts++] = split(parts[part]);
    const Index number = static_cast<Index>(tree.nodes_.size());
    tree.nodes_.emplace_back();
    Node node;
    for (int c = 0; c < kWidth; ++c) {
      const Range part = c < num_parts ? parts[c] : Range{0, 0};
      set_box(node, c, part);
      node.is_leaf[c] = part.end - part.begin <= kWidth;
      node.child[c] = c >= num_parts ? kNoIndex : node.is_leaf[c] ? add_leaf(part) : build(part);
    }
    tree.nodes_[number] = node;
    return number;
  }
};

ClosestPoint::ClosestPoint(const TriangleMesh& mesh) {
  check(mesh);
  const Index count = static_cast<Index>(mesh.triangles.size());
  Builder builder{*this, {}};
  for (Index t = 0; t < count; ++t) {
    const auto& [a, b, c] = mesh.triangles[t];
    corners_.push_back({mesh.positions[a], mesh.positions[b], mesh.positions[c]});
    builder.centres.push_back((mesh.positions[a] + mesh.positions[b] + mesh.positions[c]) / 3);
    order_.push_back(t);
  }
  builder.build({0, count});
}

/// Squared distances to all triangles of the leaf: to the plane where p is above the inside, else to the closest edge.
void ClosestPoint::visit(const Leaf& leaf, const Vec3& p, Index& best, double& best_squared) const {
  const double px = p[0], py = p[1], pz = p[2];
  double squared[kWidth];
  // One body without branches, so that it compiles to vector instructions.
  for (int i = 0; i < kWidth; ++i) {
    const double bx = leaf.ab[0][i], by = leaf.ab[1][i], bz = leaf.ab[2][i];
    const double cx = leaf.ac[0][i], cy = leaf.ac[1][i], cz = leaf.ac[2][i];
    const double x = px - leaf.a[0][i], y = py - leaf.a[1][i], z = pz - leaf.a[2][i];
    const double nx = by * cz - bz * cy, ny = bz * cx - bx * cz, nz = bx * cy - by * cx;
    const double area = nx * nx + ny * ny + nz * nz;
    const double s = nx * (y * cz - z * cy) + ny * (z * cx - x * cz) + nz * (x * cy - y * cx);
    const double t = nx * (by * z - bz * y) + ny * (bz * x - bx * z) + nz * (bx * y - by * x);
    const double height = nx * x + ny * y + nz * z;
    const auto to_edge = [](double dx, double dy, double dz, double ex, double ey, double ez, double inverse) {
      const double along = (dx * ex + dy * ey + dz * ez) * inverse;
      const double low = along > 0 ? along : 0, at = low < 1 ? low : 1;
      const double rx = dx - at * ex, ry = dy - at * ey, rz = dz - at * ez;
      return rx * rx + ry * ry + rz * rz;
    };
    const double e0 = to_edge(x, y, z, bx, by, bz, leaf.inverse_ab[i]);
    const double e1 = to_edge(x, y, z, cx, cy, cz, leaf.inverse_ac[i]);
    const double e2 = to_edge(x - bx, y - by, z - bz, cx - bx, cy - by, cz - bz, leaf.inverse_bc[i]);
    const double e01 = e0 < e1 ? e0 : e1, edge = e01 < e2 ? e01 : e2;
    const double least = s < t ? s : t, rest = area - s - t;
    const double inside = leaf.inverse_area[i] > 0 ? (least < rest ? least : rest) : -1;
    squared[i] = inside >= 0 ? height * height * leaf.inverse_area[i] : edge;
  }
  for (int i = 0; i < kWidth; ++i)
    if (squared[i] < best_squared || (squared[i] == best_squared && leaf.triangle[i] < best)) {
      best_squared = squared[i];
      best = leaf.triangle[i];
    }
}

ClosestPoint::Hit ClosestPoint::closest(const Vec3& p, Index hint) const {
  struct Pending {
    double squared;
    Index child;
    bool is_leaf;
  };
  Index best = kNoIndex;
  double best_squared = kInfinity;
  if (hint >= 0 && static_cast<std::size_t>(hint) < num_triangles()) {
    best = hint;
    best_squared = (p - closest_on_triangle(p, corners_[hint])).squaredNorm();
  }
  Pending stack[128];  // seven more per level; 2^31 triangles are eleven levels deep
  int top = 0;
  stack[top++] = {0, 0, false};
  while (top > 0) {
    const Pending next = stack[--top];
    if (next.squared > best_squared) continue;
    if (next.is_leaf) {
      visit(leaves_[next.child], p, best, best_squared);
      continue;
    }
    const Node& node = nodes_[next.child];
    double squared[kWidth];
    for (int c = 0; c < kWidth; ++c) {
      double sum = 0;
      for (int axis = 0; axis < 3; ++axis) {
        const double below = node.low[axis][c] - p[axis], above = p[axis] - node.high[axis][c];
        const double outside = below > above ? below : above, positive = outside > 0 ? outside : 0;
        sum += positive * positive;
      }
      squared[c] = sum;
    }
    const int first = top;
    for (int c = 0; c < kWidth; ++c) {
      if (!(squared[c] <= best_squared) || node.child[c] == kNoIndex) continue;
      int at = top++;  // farthest first, so that the closest is taken next
      for (; at > first && stack[at - 1].squared < squared[c]; --at) stack[at] = stack[at - 1];
      stack[at] = {squared[c], node.child[c], node.is_leaf[c]};
    }
  }
  if (best == kNoIndex) return {p, kNoIndex, std::numeric_limits<double>::quiet_NaN()};
  const Vec3 point = closest_on_triangle(p, corners_[best]);
  return {point, best, (p - point).norm()};
}

void ClosestPoint::closest(std::span<const Vec3> points, std::span<Hit> hits) const {
  if (points.size() != hits.size())
    throw InputError("closest point: " + std::to_string(hits.size()) + " hits for " + std::to_string(points.size()) +
                     " points");
  constexpr std::size_t kRun = 256;  // hints do not pass from one run to the next, whatever thread takes it
  const std::size_t num_runs = (points.size() + kRun - 1) / kRun;
#pragma omp parallel for schedule(dynamic)
  for (std::size_t run = 0; run < num_runs; ++run) {
    Index hint = kNoIndex;
    for (std::size_t i = run * kRun; i < std::min((run + 1) * kRun, points.size()); ++i) {
      hits[i] = closest(points[i], hint);
      hint = hits[i].triangle;
    }
  }
}

}  // namespace subvol
