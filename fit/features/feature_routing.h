// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/features/crease_paths.h"
#include "subvol/fit/features/curve_parts.h"
#include "subvol/fit/features/not_followed.h"
#include "subvol/fit/features/signed_features.h"
#include "subvol/fit/tuning/automatic_tuning.h"
#include "subvol/mesh/volume_mesh.h"

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace subvol::internal {

/// A curve that no path follows, or that is followed in part.
struct UnfollowedCurve {
  Index curve;
  NotFollowed reason;
  Vec3 place;                ///< for a report: the corner at fault if no path follows it, or the middle of `points`
  std::vector<Vec3> points;  ///< the curve, or the longest of the pieces that its path leaves out
  double length;             ///< of the curve, or of all that is left out
};

/// A corner of the target, and the boundary vertex that represents it.
struct PlacedCorner {
  Index corner;  ///< a vertex of the target, in `FeatureCurves::corners`
  Index vertex;  ///< of the mesh
  friend bool operator==(const PlacedCorner&, const PlacedCorner&) = default;
};

struct RoutingOptions {
  std::vector<std::uint8_t> excluded;    ///< one entry per curve, not zero for curves to leave alone; empty: none
  std::vector<std::uint8_t> not_joined;  ///< likewise for curves that may not join the path of another one
  /// True: paths run along all sheets of the mesh, its boundary and the interfaces between regions. Numbers of cells do
  /// not matter then.
  bool on_sheets = false;
  /// One entry per curve, not zero for those whose paths run along feature curves of the sheets, which no other path
  /// uses; empty: none. Only with `on_sheets`.
  std::vector<std::uint8_t> along_sheet_curves;
  int one_in = AutomaticTuning{}.one_in;  ///< `give_up_poor_curves` gives up one in so many of the curves at fault
  /// Asked before each search; if it returns true, no more paths are found. Empty: never.
  std::function<bool()> cancelled;
};

struct FeatureRouting {
  std::vector<CreasePath> paths;      ///< ascending by curve; a curve in parts has several, in its order
  std::vector<PlacedCorner> corners;  ///< those at which a path ends, ascending by vertex
  std::vector<Index> joined;          ///< curves whose path ends inside the path of another one; ascending
  /// Holds one entry for each path of a curve that is followed in part, in the order of the paths.
  std::vector<FollowedPart> parts;
  std::vector<UnfollowedCurve> unfollowed;  ///< those followed in part are among them; ascending by curve
};

/// Finds a path of boundary edges for as many curves of a target as possible; convex curves prefer edges of one cell,
/// reflex ones edges of three.
///
/// Corners get vertices one to one, those of the least cost first:
///
///   (distance / h)^2 + 0.15 times the number of curves there without an edge of the wanted number of cells
///                    + 3 if the vertex has fewer edges than the corner has curves
///                    + 4 if distance > 1.1 h,                                              distance < 1.6 h
///
/// h is the mean length of the boundary's edges. Curves shorter than h / 2, or with an angle below 19 degrees, are left
/// alone, and so are corners without other curves. The path between two of them minimizes
///
///   integral of (d^2 + (0.12 h)^2) f ds,   d: distance to the curve,
///   f = 1, 1.5, 3 at edges of 1, 2, 3 cells if the angle is below 125 degrees; 3, 1.5, 1 if it is reflex;
///       3, 1, 1.5 if it is within 20 degrees of 180; else 1.5, and 1 at edges of 3 cells
///
/// where d is the distance to the part of the curve that the path has come to (`CurveWalk`): it takes no short cut
/// where the curve comes close to itself. Closed curves pass through the vertices nearest to three of their points; if
/// there is no such path, through vertices on one side of the paths that are there, for each side: both edges of a
/// chamfer narrower than a cell find one so. A path is accepted if it and the curve stay within 1.1 h of one another.
/// No two paths share an edge, or a vertex but corners and joins. Up to eight rounds start with the curves that failed
/// in the round before; the round that follows the greatest length counts. An open curve that is still lost may then
/// stray up to 2.2 h, and start up to three edges along the path of another curve of the same corner, in its first half
/// ("join"). If curves are lost that have a path alone, all negotiate (`negotiated_paths`), and the greater length
/// counts.
///
/// If some are lost then, all is done again with corners moved out of the way: vertices of corners on the path of
/// another curve that finds no other, the longest curves first; a corner that cannot move shares the vertex of the
/// curve's end if both belong to one cluster (`corner_clusters`). It is done once more with a shared vertex for each
/// cluster at the ends of lost curves. The greatest length counts. Curves that are still lost are followed in
/// parts (`find_parts`), the longest curves first. With `on_sheets`, there are no such parts.
///
/// mesh      passes `validate` except for unused vertices, and its boundary lies roughly on the target.
/// features  of the target, in the coordinates of the mesh.
/// Deterministic, serial. InputError: options of another size, a size that is not positive; features without one angle
/// per curve; a position on the boundary that is not finite. Without curves, everything is empty. Cost: some
/// shortest-path searches near each curve in each round.
///
/// Limits: curves that run closer than an edge to each other may exclude each other. At corners of five or more
/// curves, joins leave paths far from their curves: an icosahedron of 1,000 cells has 74 % of its edges within 0.1 %.
FeatureRouting route_features(const VolumeMesh& mesh, const SignedFeatures& features,
                              const RoutingOptions& options = {});

/// Returns a routing without the paths of some curves that are followed in parts; they are lost as a whole then.
FeatureRouting without_parts(FeatureRouting routing, std::span<const Index> curves, const FeatureCurves& all);

/// Returns the share of the curves' length that paths follow; 1 without curves.
double routed_share(const FeatureRouting& routing, const FeatureCurves& curves);

}  // namespace subvol::internal
