// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/features/feature_curves.h"
#include "subvol/fit/geometry/site_tree.h"
#include "subvol/mesh/volume_mesh.h"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace subvol::internal {

/// The edges of a mesh's boundary, or of all its sheets, as a graph in space.
class RoutingGraph {
 public:
  struct Edge {
    std::array<Index, 2> ends;
    int cells;  ///< number of cells around it; of sheets 1 on their feature curves, 2 elsewhere
  };

  /// mesh  must outlive the graph; finite positions of its boundary vertices, else InputError.
  /// on_sheets  also the edges of interfaces between regions.
  explicit RoutingGraph(const VolumeMesh& mesh, bool on_sheets = false);

  std::span<const Edge> edges() const { return edges_; }
  std::span<const Index> edges_at(Index vertex) const {
    return {around_.data() + offsets_[vertex], offsets_[vertex + 1] - offsets_[vertex]};
  }
  Index other_end(Index edge, Index vertex) const {
    const auto& ends = edges_[edge].ends;
    return ends[0] == vertex ? ends[1] : ends[0];
  }
  /// Returns the edge between two vertices, which must exist.
  Index edge_between(Index v, Index w) const;
  const Vec3& position(Index vertex) const { return mesh_->positions[vertex]; }
  std::size_t num_vertices() const { return mesh_->num_vertices(); }
  /// h: mean length of the edges; 0 without edges.
  double edge_length() const { return edge_length_; }

  /// Returns the boundary vertices within a distance of a point, ascending.
  std::vector<Index> vertices_near(const Vec3& point, double distance) const;
  /// Returns the boundary vertex nearest to a point; there must be one.
  Index nearest_vertex(const Vec3& point) const { return vertices_[tree_.site(tree_.nearest(point).place)]; }

 private:
  const VolumeMesh* mesh_;
  std::vector<Edge> edges_;
  std::vector<std::size_t> offsets_;  ///< where each vertex begins in around_
  std::vector<Index> around_, vertices_;
  double edge_length_ = 0;
  SiteTree tree_;
};

/// Returns true if an edge of the mesh lies on a curve of its length, as in grids with flat cells whose lines pass
/// through the faces of a plate.
bool has_edge_on(const RoutingGraph& graph, const FeatureCurve& curve);

/// The vertices and edges that paths may not touch, and what those cost that they may.
struct Occupied {
  std::vector<std::uint8_t> vertices, edges;
  std::vector<double> vertex_prices, edge_prices;  ///< added to the cost of a path through them; empty: 0
  void add(const RoutingGraph& graph, std::span<const Index> path);
};

}  // namespace subvol::internal
