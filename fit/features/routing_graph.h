// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/geometry/closest_point.h"
#include "subvol/fit/geometry/site_tree.h"
#include "subvol/mesh/volume_mesh.h"

#include <array>
#include <cstdint>
#include <span>
#include <unordered_map>
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
  /// sizes  as `RoutingOptions::sizes`.
  explicit RoutingGraph(const VolumeMesh& mesh, bool on_sheets = false, std::vector<double> sizes = {});

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
  /// h: mean length of the edges, each divided by the mean size of its ends; 0 without edges.
  double edge_length() const { return edge_length_; }
  double size(Index vertex) const { return sizes_.empty() ? 1 : sizes_[vertex]; }
  /// Returns the mean size of the vertices that are nearest to some points; at least one point.
  double mean_size(std::span<const Vec3> points) const;

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
  std::vector<double> sizes_;
  SiteTree tree_;
};

/// The vertices and edges that paths may not touch.
struct Occupied {
  std::vector<std::uint8_t> vertices, edges;
  void add(const RoutingGraph& graph, std::span<const Index> path);
};

/// A polyline in space and the costs of edges that are to follow it.
class FollowingCost {
 public:
  /// factors  of edges of one, two, and any other number of cells, > 0.
  /// softness length that is added to the distance, as the root of the sum of squares, > 0.  reach: edges farther away
  /// have no cost.
  FollowingCost(std::span<const Vec3> points, std::array<double, 3> factors, double softness, double reach);

  /// Returns the integral of (d^2 + softness^2) along an edge, times its factor; infinity if it is out of reach.
  double operator()(const RoutingGraph& graph, Index edge);

 private:
  double squared_distance(const Vec3& p) const;

  ClosestPoint tree_;
  std::array<double, 3> factors_;
  double softness_, reach_;
  std::unordered_map<Index, double> costs_;  ///< of the edges asked for
};

/// Returns the vertices of the cheapest path, or none. Only its ends may be occupied.
std::vector<Index> cheapest_path(const RoutingGraph& graph, FollowingCost& cost, Index from, Index to,
                                 const Occupied& occupied);

}  // namespace subvol::internal
