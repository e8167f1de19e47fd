// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/features/polyline.h"
#include "subvol/fit/features/routing_graph.h"

#include <array>
#include <span>
#include <unordered_map>
#include <vector>

namespace subvol::internal {

/// Finds paths of edges that go along a polyline from its beginning to its end.
///
/// The states of the search are pairs of a vertex and a place on the polyline where its distance to the vertex has a
/// local minimum. An edge leads from one state to another if the polyline between the places is at most three times as
/// long as the edge. So a path can neither take a short cut where the polyline comes close to itself, nor be drawn to
/// another part of it. An edge from (v, s) to (w, t) costs, with m the middle of v and w,
///
///   |w - v| f ((d(v, s)^2 + 2 d(m, (s + t) / 2)^2 + d(w, t)^2) / 4 + softness^2),   d(p, s): distance of p to place s,
///
/// that is the integral of d^2 + softness^2, times a factor f by the number of cells at the edge.
class CurveWalk {
 public:
  /// points   of the polyline, at least two.
  /// factors  of edges of one, two, and any other number of cells, > 0; infinity: not used.
  /// softness > 0.  reach  vertices farther from the polyline are not used.
  CurveWalk(std::vector<Vec3> points, std::array<double, 3> factors, double softness, double reach);

  /// Returns the vertices of the cheapest path, or none. Only its ends, which differ, may be occupied. They correspond
  /// to places of the polyline within twice the reach of its ends, however far away they are.
  /// others  more vertices that are occupied, ascending.
  /// A path along a polyline that comes close to itself may pass through a vertex twice; it counts as none.
  std::vector<Index> cheapest_path(const RoutingGraph& graph, Index from, Index to, const Occupied& occupied,
                                   std::span<const Index> others = {});

 private:
  /// A place of the polyline, and the squared distance of a vertex to it.
  struct Place {
    double along, squared_distance;
  };

  const std::vector<Place>& places(const RoutingGraph& graph, Index v);
  std::vector<Place> places_at_end(const RoutingGraph& graph, Index v, bool at_start);
  double cost(const RoutingGraph& graph, Index edge, Index v, const Place& from, Index w, const Place& to) const;

  std::vector<Vec3> points_;
  std::vector<double> along_;  ///< arc length up to each point
  std::array<double, 3> factors_;
  double softness_, reach_;
  std::unordered_map<Index, std::vector<Place>> places_;  ///< of the vertices asked for
};

}  // namespace subvol::internal
