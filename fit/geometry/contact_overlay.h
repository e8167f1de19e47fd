// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"
#include "subvol/fit/geometry/vertex_grid.h"
#include "subvol/surface/triangle_mesh.h"

#include <Eigen/Geometry>

#include <array>
#include <cstddef>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace subvol::internal {

/// Limits the work of `imprinted_contacts`.
class ContactBudget {
 public:
  /// Thrown by `spend`.
  struct Spent {};

  /// cancelled  asked now and then. Empty: never.
  explicit ContactBudget(const std::function<bool()>& cancelled) : cancelled_(cancelled) {}

  /// Counts tests of a point or a box. Throws Spent after 3e8 of them, which are a second, or if the work is cancelled.
  void spend(std::size_t tests);

 private:
  const std::function<bool()>& cancelled_;
  std::size_t num_tests_ = 0, num_since_asked_ = 0;
};

/// Some vertices of a mesh, by their coordinates, for finding those on edges.
class EdgeVertices {
 public:
  /// distance  up to which a vertex lies on an edge.
  EdgeVertices(std::span<const Index> vertices, std::span<const Vec3> positions, double distance);

  /// Returns those that lie on an edge from a to b, and are nearer to it than to its ends, from a to b: an edge from
  /// one to the next is shorter than the whole.
  std::vector<Index> on_edge(Index a, Index b, std::span<const Vec3> positions, ContactBudget& budget) const;

 private:
  double distance_;
  std::array<std::vector<std::pair<double, Index>>, 3> along_;
};

/// A triangle that replaces a part of one of a surface.
struct ContactPiece {
  std::array<Index, 3> corners;
  Index of;  ///< the triangle that it is a part of
};

/// Cuts clusters of triangles that lie on each other along each other's edges.
class ContactOverlay {
 public:
  /// mesh      gains the vertices at which edges cross; it outlives the overlay.  box: of its vertices.
  /// distance  up to which triangles touch, > 0 unless the box has a size.
  ContactOverlay(TriangleMesh& mesh, const Eigen::AlignedBox3d& box, double distance, ContactBudget& budget);

  /// Cuts one cluster of triangles, given by their numbers. Returns the pieces, each for the triangle that it is a part
  /// of; nothing if the triangles do not lie in one plane, or two of their vertices are at one place of it.
  /// ContactBudget::Spent: there are too many tests, or the work is cancelled.
  std::optional<std::vector<ContactPiece>> cut(std::span<const Index> cluster);

  /// Returns the vertices inside an edge, from its lower number on, of the clusters that both ends are in.
  const std::vector<Index>& inside(Index a, Index b);

 private:
  class Cluster;

  TriangleMesh& mesh_;
  double distance_;
  ContactBudget& budget_;
  std::vector<EdgeVertices> vertices_;                         ///< of each cluster that was cut
  std::map<Index, std::vector<std::size_t>> clusters_of_;      ///< places in vertices_ of each vertex of a cluster
  VertexGrid crossings_;                                       ///< vertices at which edges of clusters cross
  std::map<std::array<Index, 2>, std::vector<Index>> inside_;  ///< by edge, its lower vertex number first
};

}  // namespace subvol::internal
