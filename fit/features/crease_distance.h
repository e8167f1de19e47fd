// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/features/feature_curves.h"

#include <algorithm>
#include <span>

namespace subvol {

/// Distances between sharp edges of a target and fitted creases, both ways. Lengths and distances are in percent of a
/// diagonal. A curve is followed if segments name it. Distances are those between followed curves and their own
/// segments; means are over length.
struct CreaseDistance {
  std::size_t num_curves = 0, num_followed = 0;
  double target_length_percent = 0, followed_length_percent = 0;
  double mean_from_target_percent = 0, max_from_target_percent = 0;
  double mean_to_target_percent = 0, max_to_target_percent = 0;
  Vec3 farthest{0, 0, 0};            ///< point of a curve or of a crease where the larger maximum is reached
  double within_length_percent = 0;  ///< length of all curves within kSharpPercent of any crease
  double crease_length_percent = 0;  ///< length of all segments, including those that follow nothing

  double mean_percent() const { return std::max(mean_from_target_percent, mean_to_target_percent); }
  double max_percent() const { return std::max(max_from_target_percent, max_to_target_percent); }
  /// At most 1: a curve whose end shares a vertex with a corner nearby is followed a little beyond its end.
  double followed_share() const { return std::min(1.0, share(followed_length_percent)); }
  double within_share() const { return share(within_length_percent); }

 private:
  double share(double length) const { return target_length_percent > 0 ? length / target_length_percent : 1; }
};

/// A sharp edge counts as met where a crease is this close, in percent of the diagonal.
inline constexpr double kSharpPercent = 0.1;

/// Measures these distances with samples at most a thousandth of the diagonal apart on both sides.
///
/// points    ends of the segments: finite positions. Points and curves that segments name must exist, else InputError.
/// diagonal  100 percent, > 0, else InputError.
/// followed  if not null, the curves that segments name: those above, each as far as it can be followed, and more parts
///           of them after that. Distances and lengths of followed curves are those of these.
/// Deterministic. Cost: about 1 us a sample.
CreaseDistance crease_distance(const FeatureCurves& curves, std::span<const Vec3> points,
                               std::span<const CreaseSegment> segments, double diagonal,
                               const FeatureCurves* followed = nullptr);

}  // namespace subvol
