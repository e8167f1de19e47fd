// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface/triangle_mesh.h"

#include <array>
#include <cstddef>
#include <span>
#include <vector>

namespace subvol {

/// Finds closest points on a set of triangles, with a tree of axis-aligned boxes, eight children to a node.
///
/// We have our own tree because a distance check makes some 10^5 queries in well under a second: a query takes a
/// fraction of a microsecond if successive points are close to each other, several times less than with CGAL's. The
/// triangles are copied; queries are safe from many threads at once. Soups and degenerate triangles are allowed.
class ClosestPoint {
 public:
  struct Hit {
    Vec3 point;                 ///< the closest point
    Index triangle = kNoIndex;  ///< a triangle that contains it
    double distance = 0;        ///< >= 0
  };

  /// InputError: no triangles, a vertex number out of range, or a position that is not finite. Runs in parallel; the
  /// tree is the same for any number of threads. Cost: n log n.
  explicit ClosestPoint(const TriangleMesh& mesh);

  /// Moves the vertices. The tree keeps its structure and recomputes its boxes: several times faster than a new tree,
  /// and as good as long as neighbors stay neighbors. InputError: another number of vertices, or a position that is not
  /// finite.
  void move(std::span<const Vec3> positions);

  /// Returns the closest point of the surface to p. If p is not finite: triangle kNoIndex, distance NaN. If p is so far
  /// away that the square of every distance overflows: a corner of one of the triangles.
  ///
  /// hint  a triangle likely to be close (the answer for a nearby point), or kNoIndex. It saves time and has one other
  ///       effect: of several triangles at the same distance, up to rounding, the returned one may depend on it.
  Hit closest(const Vec3& p, Index hint = kNoIndex) const;

  /// Returns the closest point of the surface to p if it is nearer than a distance; else triangle kNoIndex, and that
  /// distance. Much faster than `closest` if no part of the surface is that near.
  Hit closest_within(const Vec3& p, double distance) const;

  /// Calls `closest` for many points, in parallel. Same bits for any number of threads. InputError: sizes differ.
  ///
  /// hits  in: their triangles are hints; for kNoIndex, the hint is the answer for the point before. out: the answers.
  void closest(std::span<const Vec3> points, std::span<Hit> hits) const;

  std::size_t num_triangles() const { return order_.size(); }
  /// Returns the triangles in the order of the tree's leaves: those close to each other in it are close in space.
  std::span<const Index> order() const { return order_; }

 private:
  static constexpr int kTreeWidth = 8;  // children of a node: as many boxes as one vector instruction tests

  /// Boxes of the children, coordinate by coordinate, so that all of them are tested at once.
  struct Node {
    std::array<std::array<double, kTreeWidth>, 3> low, high;
    std::array<Index, kTreeWidth> child;  ///< number of a node or leaf; kNoIndex: no child
    std::array<bool, kTreeWidth> is_leaf;
  };
  /// Triangles, coordinate by coordinate for the same reason; unused lanes repeat the first triangle.
  struct Leaf {
    using Lanes = std::array<double, kTreeWidth>;
    std::array<Lanes, 3> a, ab, ac;
    Lanes inverse_ab, inverse_ac, inverse_bc;  ///< 1 / squared length; 0 if the length is 0
    Lanes inverse_area;                        ///< 1 / |ab x ac|^2; 0 for slivers: only edges count
    std::array<Index, kTreeWidth> triangle;
  };
  struct Range {
    Index begin, end;  ///< places in order_
  };
  /// Up to kTreeWidth parts of a range, none empty, by repeated halving.
  struct Parts {
    std::array<Range, kTreeWidth> ranges;
    int count = 1;
  };
  struct Item {
    Vec3 center;
    Index triangle;
  };

  template <class Split>
  static Parts parts_of(Range range, Split&& split);
  static void partition(std::vector<Item>& items, Range range);
  Index add_node(Range range);
  void fit_boxes();
  /// Replaces a triangle and the square of its distance by those of a nearer triangle, if there is one.
  void search(const Vec3& p, Index& best, double& best_squared) const;
  void visit(const Leaf& leaf, const Vec3& p, Index& best, double& best_squared) const;

  std::vector<Node> nodes_;  // parents before their children
  std::vector<Leaf> leaves_;
  std::vector<Range> leaf_ranges_;
  std::vector<std::array<Index, 3>> triangles_;
  std::vector<std::array<Vec3, 3>> corners_;  // by triangle
  std::vector<Index> order_;
  std::size_t num_vertices_ = 0;
};

}  // namespace subvol
