// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/features/feature_curves.h"
#include "subvol/surface/triangle_mesh.h"

#include <cstddef>
#include <vector>

namespace subvol::internal {

/// The regions on both sides of a curve, seen from outside along its direction.
struct CurveSides {
  Index left = kNoIndex, right = kNoIndex;
  bool has(Index region) const { return left == region || right == region; }
};

/// The sharp edges of a solid with the angles of the solid along them, and the parts of the surface between them.
struct SignedFeatures {
  FeatureCurves curves;
  /// Interior angle of the solid at each segment of each curve, in degrees in [0, 360]: below 180 at a convex edge,
  /// above at a reflex one. 180 next to a triangle without area.
  std::vector<std::vector<double>> segment_angles;
  std::vector<double> angles;  ///< mean of each curve over its length
  std::vector<Index> regions;  ///< region of each triangle: triangles connected without crossing a curve
  std::size_t num_regions = 0;
  std::vector<CurveSides> sides;  ///< of each curve

  bool is_convex(Index curve) const { return angles[curve] < 180; }
};

/// Measures the angles along curves and finds the regions between them.
///
/// target  oriented outward, as `solid_boundary` returns it.
/// curves  along edges of the target, from `feature_curves`.
/// returns regions numbered by their first triangles. InputError: a vertex number out of range; a curve along something
/// that is not an edge of exactly two triangles, or one along which they are inconsistently oriented. Cost: one sort of
/// the edges.
SignedFeatures signed_features(const TriangleMesh& target, FeatureCurves curves);

/// Returns the unit direction in which a curve leaves its first point (`from_front`) or its last one: that to the first
/// point of the curve which is farther away than `reach`, or to the other end. Zero if that is the same point.
Vec3 direction_at_end(const FeatureCurve& curve, bool from_front, double reach);

}  // namespace subvol::internal
