// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/geometry/closest_point.h"

#include "subvol/base/error.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <string>

namespace subvol {

namespace {

constexpr std::size_t kFewTriangles = 1000;  // for so few, one thread is faster than several

Vec3 closest_on_segment(const Vec3& p, const Vec3& a, const Vec3& b) {
  const Vec3 ab = b - a;
  const double length_squared = ab.squaredNorm(), t = ab.dot(p - a);
  if (t <= 0 || length_squared == 0) return a;
  return t >= length_squared ? b : Vec3(a + (t / length_squared) * ab);
}

/// True if the sine of the angle is below 1e-12: then the normal is rounding, and the edges are as close as the inside.
bool is_sliver(double area_squared, double ab_squared, double ac_squared) {
  return !(area_squared > 1e-24 * ab_squared * ac_squared);
}

/// Returns the foot of the perpendicular if p is inside the triangle's prism, else the closest point of the edges that
/// p lies beyond.
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

void check_finite(std::span<const Vec3> positions, Index v) {
  if (!positions[v].allFinite()) throw InputError("closest point: vertex " + std::to_string(v) + " is not finite");
}

void check(const TriangleMesh& mesh) {
  if (mesh.triangles.empty()) throw InputError("closest point: the surface has no triangles");
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (const Index v : mesh.triangles[t]) {
      if (v < 0 || static_cast<std::size_t>(v) >= mesh.positions.size())
        throw InputError("closest point: triangle " + std::to_string(t) + " names vertex " + std::to_string(v) +
                         " of " + std::to_string(mesh.positions.size()));
      check_finite(mesh.positions, v);
    }
}

}  // namespace

/// Halves the range until it has kTreeWidth parts or no part is larger than a leaf; calls split(lower, upper) for each
/// cut.
template <class Split>
ClosestPoint::Parts ClosestPoint::parts_of(Range range, Split&& split) {
  Parts parts{{range}};
  for (int round = 0; round < 3; ++round)
    for (int i = 0, existing = parts.count; i < existing; ++i) {
      Range& part = parts.ranges[i];
      const Index size = part.end - part.begin;
      if (size <= kTreeWidth) continue;
      const Range upper{part.begin + size / 2, part.end};
      part.end = upper.begin;
      split(part, upper);
      parts.ranges[parts.count++] = upper;
    }
  return parts;
}

/// Orders the items like the tree's leaves: every cut is at the median along the longest axis.
void ClosestPoint::partition(std::vector<Item>& items, Range range) {
  constexpr Index kLeastTask = 4096;  // items; smaller tasks cost more than they save
  const Parts parts = parts_of(range, [&](Range lower, Range upper) {
    const auto first = items.begin() + lower.begin, last = items.begin() + upper.end;
    Vec3 low = Vec3::Constant(kInfinity), high = -low;
    for (auto i = first; i != last; ++i) {
      low = low.cwiseMin(i->center);
      high = high.cwiseMax(i->center);
    }
    int axis;
    (high - low).maxCoeff(&axis);
    std::nth_element(first, items.begin() + upper.begin, last, [axis](const Item& a, const Item& b) {
      return a.center[axis] != b.center[axis] ? a.center[axis] < b.center[axis] : a.triangle < b.triangle;
    });
  });
  for (int i = 0; i < parts.count; ++i) {
    const Range part = parts.ranges[i];
    if (part.end - part.begin <= kTreeWidth) continue;
#pragma omp task shared(items) firstprivate(part) if (part.end - part.begin > kLeastTask)
    partition(items, part);
  }
#pragma omp taskwait
}

/// Adds the node of a range and all nodes below it. The cuts depend on counts alone.
Index ClosestPoint::add_node(Range range) {
  const Parts parts = parts_of(range, [](Range, Range) {});
  const Index number = static_cast<Index>(nodes_.size());
  nodes_.emplace_back();
  for (int c = 0; c < kTreeWidth; ++c) {
    Index child = kNoIndex;
    const bool is_leaf = c < parts.count && parts.ranges[c].end - parts.ranges[c].begin <= kTreeWidth;
    if (is_leaf) {
      child = static_cast<Index>(leaf_ranges_.size());
      leaf_ranges_.push_back(parts.ranges[c]);
    } else if (c < parts.count) {
      child = add_node(parts.ranges[c]);
    }
    nodes_[number].child[c] = child;
    nodes_[number].is_leaf[c] = is_leaf;
  }
  return number;
}

/// Computes the leaves and the boxes from the triangles' corners.
void ClosestPoint::fit_boxes() {
  struct Box {
    Vec3 low = Vec3::Constant(kInfinity), high = Vec3::Constant(-kInfinity);
  };
  const auto inverse = [](double x) { return x > 0 ? 1 / x : 0; };
  std::vector<Box> of_leaf(leaves_.size()), of_node(nodes_.size());
#pragma omp parallel for schedule(static) if (triangles_.size() > kFewTriangles)
  for (std::size_t i = 0; i < leaves_.size(); ++i) {
    const Range range = leaf_ranges_[i];
    Leaf& leaf = leaves_[i];
    for (int lane = 0; lane < kTreeWidth; ++lane) {
      const Index t = order_[range.begin + (lane < range.end - range.begin ? lane : 0)];
      const auto& x = corners_[t];
      for (const Vec3& p : x) of_leaf[i] = {of_leaf[i].low.cwiseMin(p), of_leaf[i].high.cwiseMax(p)};
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
  }
  for (std::size_t i = nodes_.size(); i-- > 0;)
    for (int c = 0; c < kTreeWidth; ++c) {
      const Index child = nodes_[i].child[c];
      const Box box = child == kNoIndex ? Box{} : nodes_[i].is_leaf[c] ? of_leaf[child] : of_node[child];
      for (int axis = 0; axis < 3; ++axis) {
        nodes_[i].low[axis][c] = box.low[axis];
        nodes_[i].high[axis][c] = box.high[axis];
      }
      of_node[i] = {of_node[i].low.cwiseMin(box.low), of_node[i].high.cwiseMax(box.high)};
    }
}

ClosestPoint::ClosestPoint(const TriangleMesh& mesh)
    : triangles_(mesh.triangles), corners_(mesh.triangles.size()), num_vertices_(mesh.positions.size()) {
  check(mesh);
  const Index count = static_cast<Index>(triangles_.size());
  std::vector<Item> items(count);
#pragma omp parallel if (triangles_.size() > kFewTriangles)
  {
#pragma omp for schedule(static)
    for (Index t = 0; t < count; ++t) {
      const auto& [a, b, c] = triangles_[t];
      items[t] = {(mesh.positions[a] + mesh.positions[b] + mesh.positions[c]) / 3, t};
    }
#pragma omp single
    partition(items, {0, count});
  }
  order_.resize(count);
  for (Index i = 0; i < count; ++i) order_[i] = items[i].triangle;
  add_node({0, count});
  leaves_.resize(leaf_ranges_.size());
  move(mesh.positions);
}

void ClosestPoint::move(std::span<const Vec3> positions) {
  if (positions.size() != num_vertices_)
    throw InputError("closest point: " + std::to_string(positions.size()) + " positions for " +
                     std::to_string(num_vertices_) + " vertices");
  for (const auto& triangle : triangles_)
    for (Index v : triangle) check_finite(positions, v);
#pragma omp parallel for schedule(static) if (triangles_.size() > kFewTriangles)
  for (std::size_t t = 0; t < triangles_.size(); ++t)
    for (int k = 0; k < 3; ++k) corners_[t][k] = positions[triangles_[t][k]];
  fit_boxes();
}

/// Updates the best triangle with those of the leaf. The squared distance is that to the plane if p is above the
/// inside, else that to the closest edge.
void ClosestPoint::visit(const Leaf& leaf, const Vec3& p, Index& best, double& best_squared) const {
  const double px = p[0], py = p[1], pz = p[2];
  double squared[kTreeWidth];
  // One loop body without branches, so that it compiles to vector instructions.
  for (int i = 0; i < kTreeWidth; ++i) {
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
  for (int i = 0; i < kTreeWidth; ++i)
    if (squared[i] < best_squared || (squared[i] == best_squared && leaf.triangle[i] < best)) {
      best_squared = squared[i];
      best = leaf.triangle[i];
    }
}

void ClosestPoint::search(const Vec3& p, Index& best, double& best_squared) const {
  struct Pending {
    double squared;
    Index child;
    bool is_leaf;
  };
  Pending stack[128];  // at most seven more per level; 2^31 triangles make eleven levels
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
    double squared[kTreeWidth];
    for (int c = 0; c < kTreeWidth; ++c) {
      double sum = 0;
      for (int axis = 0; axis < 3; ++axis) {
        const double below = node.low[axis][c] - p[axis], above = p[axis] - node.high[axis][c];
        const double outside = below > above ? below : above, positive = outside > 0 ? outside : 0;
        sum += positive * positive;
      }
      squared[c] = sum;
    }
    const int first = top;
    unsigned near = 0;
    for (int c = 0; c < kTreeWidth; ++c) near |= static_cast<unsigned>(squared[c] <= best_squared) << c;
    for (; near != 0; near &= near - 1) {
      const int c = std::countr_zero(near);
      if (node.child[c] == kNoIndex) continue;
      int at = top++;  // the farthest first, so that the closest is taken next
      for (; at > first && stack[at - 1].squared < squared[c]; --at) stack[at] = stack[at - 1];
      stack[at] = {squared[c], node.child[c], node.is_leaf[c]};
    }
  }
}

ClosestPoint::Hit ClosestPoint::closest(const Vec3& p, Index hint) const {
  Index best = kNoIndex;
  double best_squared = kInfinity;
  if (hint >= 0 && static_cast<std::size_t>(hint) < num_triangles()) {
    best = hint;
    best_squared = (p - closest_on_triangle(p, corners_[hint])).squaredNorm();
  }
  search(p, best, best_squared);
  if (!(best_squared < kInfinity)) {
    if (!p.allFinite()) return {p, kNoIndex, std::numeric_limits<double>::quiet_NaN()};
    const Vec3& corner = corners_[order_.front()][0];
    return {corner, order_.front(), (p - corner).stableNorm()};
  }
  const Vec3 point = closest_on_triangle(p, corners_[best]);
  return {point, best, (p - point).norm()};
}

ClosestPoint::Hit ClosestPoint::closest_within(const Vec3& p, double distance) const {
  Index best = kNoIndex;
  double best_squared = distance * distance;
  search(p, best, best_squared);
  if (best == kNoIndex) return {p, kNoIndex, distance};
  const Vec3 point = closest_on_triangle(p, corners_[best]);
  return {point, best, (p - point).norm()};
}

void ClosestPoint::closest(std::span<const Vec3> points, std::span<Hit> hits) const {
  if (points.size() != hits.size())
    throw InputError("closest point: " + std::to_string(hits.size()) + " hits for " + std::to_string(points.size()) +
                     " points");
  constexpr std::size_t kQueriesPerRun = 256;  // they share hints, whatever thread takes them
  const std::size_t num_runs = (points.size() + kQueriesPerRun - 1) / kQueriesPerRun;
#pragma omp parallel for schedule(dynamic) if (num_runs > 1)
  for (std::size_t run = 0; run < num_runs; ++run) {
    Index before = kNoIndex;
    for (std::size_t i = run * kQueriesPerRun; i < std::min((run + 1) * kQueriesPerRun, points.size()); ++i) {
      hits[i] = closest(points[i], hits[i].triangle == kNoIndex ? before : hits[i].triangle);
      before = hits[i].triangle;
    }
  }
}

}  // namespace subvol
