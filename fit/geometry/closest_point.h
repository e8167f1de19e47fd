// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface/triangle_mesh.h"

#include <array>
#include <cstddef>
#include <span>
#include <vector>

namespace subvol {

/// Closest points of a set of triangles, by a tree of axis-aligned boxes, eight children to a node.
///
/// A tree of its own because a distance check asks some 10^5 such questions in well under a second: it answers in a
/// fraction of a microsecond where neighbouring questions follow each other, several times faster than CGAL's.
/// Copies the triangles; queries are safe from many threads at once. Soups and degenerate triangles are welcome.
class ClosestPoint {
 public:
  struct Hit {
    Vec3 point;                  ///< the closest point
    Index triangle = kNoIndex;   ///< a triangle that holds it
    double distance = 0;         ///< >= 0
  };

  /// InputError: no triangles, a vertex number out of range, a position that is not finite. Parallel, the same tree for
  /// any number of threads. Cost: n log n.
  explicit ClosestPoint(const TriangleMesh& mesh);

  /// Moves the vertices. The tree keeps its shape and fits its boxes anew: several times faster than a new tree, and as
  /// good as long as neighbours stay neighbours. InputError: another number of vertices, a position that is not finite.
  void move(std::span<const Vec3> positions);

  /// The closest point of the surface to p. Where p is not finite: triangle kNoIndex, distance NaN. Where it is so far
  /// away that the square of every distance overflows: a corner of one of the triangles.
  ///
  /// hint  a triangle likely to be close (the answer for a point near by), or kNoIndex. It saves time and nothing else,
  ///       but that of several triangles at the same distance, up to rounding, the one returned may depend on it.
  Hit closest(const Vec3& p, Index hint = kNoIndex) const;

  /// `closest` for many points, in parallel. Same bits for any number of threads. InputError: sizes differ.
  ///
  /// hits  in: their triangles are hints; where those are kNoIndex, the answer for the point before serves.
  void closest(std::span<const Vec3> points, std::span<Hit> hits) const;

  std::size_t num_triangles() const { return order_.size(); }
  /// Triangles in the order of the tree's leaves: neighbours in it are neighbours in space.
  std::span<const Index> order() const { return order_; }

 private:
  static constexpr int kWidth = 8;

  /// Boxes of the children, by coordinate so that all of them are tested at once.
  struct Node {
    std::array<std::array<double, kWidth>, 3> low, high;
    std::array<Index, kWidth> child;    ///< number of a node or leaf; kNoIndex: no child
    std::array<bool, kWidth> is_leaf;
  };
  /// Triangles by coordinate for the same reason; unused places repeat the first triangle.
  struct Leaf {
    using Lanes = std::array<double, kWidth>;
    std::array<Lanes, 3> a, ab, ac;
    Lanes inverse_ab, inverse_ac, inverse_bc;  ///< 1 / squared length, 0 for none
    Lanes inverse_area;                        ///< 1 / |ab x ac|^2, 0 for slivers: only their edges count
    std::array<Index, kWidth> triangle;
  };
  struct Range {
    Index begin, end;  ///< places in order_
  };
  /// Up to kWidth parts of a range, none empty, by repeated halving.
  struct Parts {
    std::array<Range, kWidth> ranges;
    int count = 1;
  };
  struct Item {
    Vec3 centre;
    Index triangle;
  };

  template <class Split>
  static Parts parts_of(Range range, Split&& split);
  static void partition(std::vector<Item>& items, Range range);
  Index add_node(Range range);
  void fit_boxes();
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
