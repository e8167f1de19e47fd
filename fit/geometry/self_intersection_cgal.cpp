// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/geometry/self_intersection.h"

#include "subvol/base/error.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/box_intersection_d.h>
#include <CGAL/intersections.h>

#include <algorithm>
#include <string>

namespace subvol::internal {

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using Box = CGAL::Box_intersection_d::Box_with_info_d<double, 3, Index, CGAL::Box_intersection_d::ID_FROM_BOX_ADDRESS>;
using Pair = std::array<Index, 2>;
using Triangle = std::array<Index, 3>;

class PairTest {
 public:
  PairTest(const TriangleMesh& mesh, const std::vector<Point>& points) : mesh_(mesh), points_(points) {}

  bool meet_improperly(Index t, Index s) const {
    Triangle a = mesh_.triangles[t], b = mesh_.triangles[s];
    int common = 0;  // common corners go to the front of both
    for (int i = 0; i < 3; ++i)
      for (int j = common; j < 3; ++j)
        if (i >= common && a[i] == b[j]) {
          std::swap(a[i], a[common]);
          std::swap(b[j], b[common]);
          ++common;
          break;
        }
    switch (common) {
      case 0: return CGAL::do_intersect(triangle(a), triangle(b));
      case 1: return meet_beyond_corner(a, b);
      case 2: return are_folded(a, b);
      default: return true;
    }
  }

 private:
  Kernel::Triangle_3 triangle(const Triangle& t) const { return {points_[t[0]], points_[t[1]], points_[t[2]]}; }

  /// Triangles that share their first corner meet elsewhere exactly if the opposite edge of either meets the other.
  bool meet_beyond_corner(const Triangle& a, const Triangle& b) const {
    // Most pairs are decided here: opposite edges far from the other triangle, or strictly on one side of its plane.
    if (boxes_are_apart(a, b) && boxes_are_apart(b, a)) return false;
    if (strictly_beside(a, b) || strictly_beside(b, a)) return false;
    return CGAL::do_intersect(triangle(a), Kernel::Segment_3(points_[b[1]], points_[b[2]])) ||
           CGAL::do_intersect(triangle(b), Kernel::Segment_3(points_[a[1]], points_[a[2]]));
  }
  /// True if the boxes of the edge opposite to the first corner and of a triangle are disjoint.
  bool boxes_are_apart(const Triangle& edge, const Triangle& triangle) const {
    for (int axis = 0; axis < 3; ++axis) {
      const auto at = [&](Index v) { return mesh_.positions[v][axis]; };
      const auto [low, high] = std::minmax({at(edge[1]), at(edge[2])});
      const auto [least, most] = std::minmax({at(triangle[0]), at(triangle[1]), at(triangle[2])});
      if (high < least || most < low) return true;
    }
    return false;
  }
  bool strictly_beside(const Triangle& plane, const Triangle& other) const {
    const auto side = [&](Index v) {
      return CGAL::orientation(points_[plane[0]], points_[plane[1]], points_[plane[2]], points_[v]);
    };
    const auto first = side(other[1]);
    return first != CGAL::COPLANAR && first == side(other[2]);
  }

  /// True if triangles that share their first two corners lie in one plane, on the same side of the common edge.
  bool are_folded(const Triangle& a, const Triangle& b) const {
    const Point &p = points_[a[0]], &q = points_[a[1]], &r = points_[a[2]], &s = points_[b[2]];
    return CGAL::coplanar(p, q, r, s) && CGAL::coplanar_orientation(p, q, r, s) == CGAL::POSITIVE;
  }

  const TriangleMesh& mesh_;
  const std::vector<Point>& points_;
};

std::vector<Point> checked_points(const TriangleMesh& mesh) {
  std::vector<Point> points;
  points.reserve(mesh.positions.size());
  for (const Vec3& p : mesh.positions) points.emplace_back(p[0], p[1], p[2]);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (const Index v : mesh.triangles[t]) {
      if (v < 0 || static_cast<std::size_t>(v) >= points.size())
        throw InputError("self-intersection: triangle " + std::to_string(t) + " names vertex " + std::to_string(v) +
                         " of " + std::to_string(points.size()));
      if (!mesh.positions[v].allFinite())
        throw InputError("self-intersection: vertex " + std::to_string(v) + " is not finite");
    }
  return points;
}

/// Tests the pairs of triangles whose boxes meet, in chunks, because there may be too many of them to keep.
class Search {
 public:
  Search(const PairTest& test, const std::function<bool()>& cancelled, SelfIntersections& result)
      : test_(test), cancelled_(cancelled), result_(result) {}

  /// Tests the pairs among some boxes, and those of one of them and one of the others.
  void run(const std::vector<Box>& boxes, const std::vector<Box>& others) {
    const auto pointers_to = [](const std::vector<Box>& all) {
      std::vector<const Box*> pointers;
      for (const Box& box : all) pointers.push_back(&box);
      return pointers;
    };
    std::vector<const Box*> own = pointers_to(boxes), rest = pointers_to(others);
    const auto take_pair = [&](const Box* a, const Box* b) { take(a->info(), b->info()); };
    constexpr std::ptrdiff_t kCutoff = 200;  // boxes up to which all pairs are tested; flat from 50 to 2000
    try {
      CGAL::box_self_intersection_d(own.begin(), own.end(), take_pair, kCutoff);
      if (!rest.empty()) CGAL::box_intersection_d(own.begin(), own.end(), rest.begin(), rest.end(), take_pair, kCutoff);
      test_some();
    } catch (const Ended&) {
      result_.is_complete = false;
    }
    std::sort(result_.pairs.begin(), result_.pairs.end());
  }

 private:
  struct Ended {};

  void take(Index i, Index j) {
    some_.push_back({std::min(i, j), std::max(i, j)});
    if (some_.size() < kPairsAtATime) return;
    test_some();
    if (cancelled_ && cancelled_()) throw Ended();
  }

  void test_some() {
    meet_.resize(some_.size());
#pragma omp parallel for schedule(dynamic, 1024)
    for (std::size_t i = 0; i < some_.size(); ++i) meet_[i] = test_.meet_improperly(some_[i][0], some_[i][1]);
    for (std::size_t i = 0; i < some_.size(); ++i) {
      if (!meet_[i]) continue;
      if (result_.pairs.size() == kMostIntersectingPairs) throw Ended();
      result_.pairs.push_back(some_[i]);
    }
    some_.clear();
  }

  static constexpr std::size_t kPairsAtATime = 1 << 18;  // tested by all threads before the next are collected; 2 MB
  const PairTest& test_;
  const std::function<bool()>& cancelled_;
  SelfIntersections& result_;
  std::vector<Pair> some_;
  std::vector<char> meet_;
};

}  // namespace

SelfIntersections self_intersections(const TriangleMesh& mesh, const std::function<bool()>& cancelled,
                                     std::span<const std::uint8_t> marked) {
  if (!marked.empty() && marked.size() != mesh.triangles.size())
    throw InputError("self-intersection: one mark is expected for each triangle");
  const std::vector<Point> points = checked_points(mesh);
  SelfIntersections result;
  std::vector<Box> boxes, others;
  boxes.reserve(mesh.triangles.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& [a, b, c] = mesh.triangles[t];
    if (CGAL::collinear(points[a], points[b], points[c]))
      result.degenerate.push_back(static_cast<Index>(t));
    else
      (marked.empty() || marked[t] ? boxes : others)
          .emplace_back(points[a].bbox() + points[b].bbox() + points[c].bbox(), static_cast<Index>(t));
  }
  Search(PairTest(mesh, points), cancelled, result).run(boxes, others);
  return result;
}

std::size_t count_intersecting_pairs(const TriangleMesh& mesh, const std::function<bool()>& cancelled) {
  const SelfIntersections found = self_intersections(mesh, cancelled);
  return found.is_complete ? found.pairs.size() : kMostIntersectingPairs;
}

}  // namespace subvol::internal
