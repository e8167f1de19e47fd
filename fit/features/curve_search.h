// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/features/corner_placement.h"
#include "subvol/fit/features/curve_walk.h"
#include "subvol/fit/features/routing_graph.h"
#include "subvol/fit/features/signed_features.h"
#include "subvol/fit/geometry/closest_point.h"

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

namespace subvol::internal {

/// Searches for paths of boundary edges that follow the curves of a target, one curve at a time, as `route_features`
/// defines them.
class CurveSearch {
 public:
  /// A path and how well it follows its curve.
  struct Found {
    std::vector<Index> path;
    double gap;  ///< largest distance between the path and the curve, either way, in units of h
  };

  /// graph, features, corners  must outlive the object.
  /// along_sheet_curves  as in `RoutingOptions` if paths run along all sheets; nothing: they run along the boundary.
  /// cancelled  as in `RoutingOptions`.
  CurveSearch(const RoutingGraph& graph, const SignedFeatures& features, const CornerPlacement& corners,
              std::optional<std::span<const std::uint8_t>> along_sheet_curves, std::function<bool()> cancelled = {});
  CurveSearch(const CurveSearch&) = delete;
  CurveSearch& operator=(const CurveSearch&) = delete;

  /// Looks for a path of a curve that touches nothing occupied but its corners.
  std::optional<Found> find(Index c, const Occupied& occupied);

  /// Looks for a path along a part of a curve (`points_between`). It ends at any free vertex nearby where the curve
  /// goes on or a corner has no vertex. Returns no vertices if there is none.
  std::vector<Index> find_part(Index c, double from, double to, const Occupied& occupied) const;

  /// Looks for paths of an open curve between two vertices that may stray from it by up to `most`, in units of h.
  class Straying {
   public:
    Straying(const CurveSearch& search, Index c, double most);
    std::optional<Found> find(Index from, Index to, const Occupied& occupied);

   private:
    const CurveSearch& search_;
    Index curve_;
    double most_;
    CurveWalk walk_;
  };

  /// Must be called if a corner of the curve has moved.
  void forget(Index c) { courses_[c].clear(); }

 private:
  /// A place that a path passes through, at a vertex that is chosen anew for each search.
  struct Anchor {
    Vec3 point;
    Index fixed;  ///< the vertex, or kNoIndex if any vertex nearby will do
  };
  /// Anchors, and the walk from each to the next one.
  struct Course {
    std::vector<Anchor> anchors;
    std::vector<CurveWalk> legs;
  };

  /// Returns true if an open curve ends at a corner without a vertex.
  bool lacks_corner(Index c) const;
  std::vector<Course>& courses(Index c);
  Course straight_course(Index c) const;
  Course course_by_middle(Index c) const;
  Course round_course(Index c) const;
  double place_nearest_to_vertex(Index c) const;
  /// most: distance beyond which no path goes, in units of h.
  CurveWalk walk_along(Index c, std::vector<Vec3> points, double most = kFollowDistance) const;
  std::vector<Index> anchor_vertices(const Course& course, const Occupied& occupied,
                                     std::span<const Index> allowed) const;
  std::vector<Index> path_on(Course& course, Index c, const Occupied& occupied,
                             std::span<const Index> allowed = {}) const;
  std::optional<Found> find_on_one_side(Index c, const Occupied& occupied);
  bool is_cancelled() const { return cancelled_ && cancelled_(); }
  std::optional<Found> judged(std::vector<Index> path, Index c, std::span<const Vec3> curve, double most) const;

  const RoutingGraph& graph_;
  const SignedFeatures& features_;
  const std::vector<FeatureCurve>& curves_;
  const CornerPlacement& corners_;
  std::optional<std::span<const std::uint8_t>> along_sheet_curves_;
  std::function<bool()> cancelled_;
  double h_;                                  ///< mean length of the edges
  std::vector<ClosestPoint> trees_;           ///< of the curves
  std::vector<std::vector<Course>> courses_;  ///< by curve, made when first needed
};

}  // namespace subvol::internal
