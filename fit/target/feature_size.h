// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/target/target_surface.h"

#include <functional>
#include <optional>
#include <span>
#include <vector>

namespace subvol {

class ClosestPoint;

/// Sizes of the small features of a surface at sample points: holes, pins, walls, slots.
struct FeatureSizes {
  std::vector<Vec3> points;
  std::vector<double> sizes;  ///< radius at each point, in the surface's unit
};

/// Finds where two sides of a surface are close and opposite: the radius of the ball that touches the surface at a
/// point from either side, and again about opposite to it (the medial ball). The radius of a hole or a pin; half the
/// thickness of a wall, and half the width of a slot or gap.
///
/// A ball starts with the radius `most`, touches the surface at p with normal n, and shrinks while it contains a point
/// q of the surface:
///
///   r <- |p - q|^2 / (2 n . (p - q))
///
/// It counts if q - c and p - c, c its center, are at least 150 degrees apart: the ball between the two sides of an
/// edge of 90 degrees, whose radius falls to 0 at the edge, is no feature.
///
/// surface  its samples are tried; points of clouds and samples without a normal are not.
/// tree     of the same surface.
/// least    smallest radius that is of interest, >= 0: crossings and slivers of a triangulation look like tiny slots.
/// most     largest one, > least. InputError: another range.
/// cancelled  asked every few thousand samples; may be empty. If it returns true, the samples so far count.
/// returns  the samples with a radius in that range, in their order. Empty if there is none.
/// Parallel; same bits for any number of threads. Cost: some six closest points for each sample and side.
FeatureSizes feature_sizes(const TargetSurface& surface, const ClosestPoint& tree, double least, double most,
                           const std::function<bool()>& cancelled = {});

/// The place where a fitted surface misses a feature by the largest share of its size.
struct FeatureMiss {
  double share = 0;  ///< distance / size
  double distance = 0, size = 0;
  Vec3 place{0, 0, 0};  ///< a point of the feature
};

/// Returns the distance from each point of features to a fitted surface. InputError: as `ClosestPoint::closest`.
std::vector<double> feature_distances(const FeatureSizes& features, const ClosestPoint& fitted);

/// Returns the largest distance as a share of the size there, among the points of features of at least `least_size`;
/// nothing if there are none.
/// distances  one for each point of the features, in their order, in the unit of their sizes.
std::optional<FeatureMiss> largest_feature_miss(const FeatureSizes& features, std::span<const double> distances,
                                                double least_size = 0);

}  // namespace subvol
