// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/features/routing_graph.h"
#include "subvol/fit/features/signed_features.h"

#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <vector>

namespace subvol::internal {

/// Largest distance between a path and its curve, in units of h (`route_features`).
inline constexpr double kFollowDistance = 1.1;

/// The vertices of a mesh that represent the corners of a target, one to one: those of the least cost first, as
/// `route_features` defines it. Corners of one cluster may be made to share a vertex afterwards.
class CornerPlacement {
 public:
  /// graph, features  must outlive the object.
  /// followed  one entry per curve, not zero for curves that paths are to follow; corners without such curves get none.
  /// vanishing likewise for curves that are too short for a path: see `corner_clusters`.
  CornerPlacement(const RoutingGraph& graph, const SignedFeatures& features, std::span<const std::uint8_t> followed,
                  std::span<const std::uint8_t> vanishing);

  /// Returns the corner whose place this one takes: itself, unless it shares a vertex.
  Index representative(Index corner) const;
  /// Returns the vertex of a corner, or kNoIndex.
  Index vertex_of(Index corner) const;
  /// Returns the corner at a vertex, the representative if several share it, or kNoIndex.
  Index corner_at(Index vertex) const;
  /// One entry per vertex of the graph: 1 if it represents a corner, else 0.
  const std::vector<std::uint8_t>& taken() const { return taken_; }

  /// Moves a representative corner to the free vertex of the least cost, with extra(vertex) added, from which paths
  /// still follow the curves of the corner. Returns false if there is none; extra: infinity for vertices that are out
  /// of the question.
  bool move(Index corner, const std::function<double(Index)>& extra);
  /// Makes a representative corner share the vertex of another corner of its cluster, and frees its own. Returns false
  /// if that is not possible.
  bool share(Index corner, Index other);
  /// Makes all corners of a corner's cluster share one vertex: that of the corner of the most curves. Returns false if
  /// there is nothing to do.
  bool share_all(Index corner);

 private:
  struct Needs {
    Vec3 position = Vec3::Zero();
    int curves = 0, convex = 0;
  };

  void find_needs(const SignedFeatures& features, std::span<const std::uint8_t> followed);
  void place();
  double distance(const Needs& needs, Index vertex) const;  ///< in units of h
  double cost(const Needs& needs, Index vertex) const;

  const RoutingGraph& graph_;
  double h_;
  std::map<Index, Index> clusters_;              ///< `corner_clusters`
  std::map<Index, std::vector<Index>> members_;  ///< of each cluster, by its number
  std::map<Index, Index> representatives_;       ///< of the corners that share a vertex of another one
  std::map<Index, Needs> needs_;                 ///< by representative corner
  std::map<Index, Index> vertex_of_corner_;
  std::vector<std::uint8_t> taken_;
};

}  // namespace subvol::internal
