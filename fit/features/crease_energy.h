// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"
#include "subvol/fit/features/feature_curves.h"
#include "subvol/fit/geometry/closest_point.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace subvol::internal {

/// Squared distance between crease curves of the fitted surface S and the feature curves of the target T that they
/// follow, both ways, with frozen correspondences. It is added to a `SurfaceTerm`, which scales it like its own terms.
///
///   E_C = width (sum_k b_k (y_k - s(y_k))^T M (y_k - s(y_k)) + sum_q c_q (x_q - t(x_q))^T M (x_q - t(x_q)))
///   M = I - (1 - tau) d d^T,  d: direction of T's curve; M = I if t(x_q) is an end of an open curve
///
/// y_k, b_k   points of T's curves and the length that each represents;  s(y): closest point of S's curve
/// x_q, c_q   points of S's curves with their lengths;  t(x): closest point of T's curve
/// width      a crease counts as much as a strip of the surface of this width
///
/// The ends of an open curve also correspond to each other, with M = I and the length of S's last segment, so that
/// creases end where T's do.
///
/// Each curve of S knows its curve of T: nothing is drawn to a neighboring edge, however close.
class CreaseEnergy {
 public:
  /// A correspondence between a point of T and a point of one segment of S: (1 - at) z_0 + at z_1.
  struct Link {
    std::array<Index, 2> ends;
    double at, weight;
    Vec3 point;
    Mat3 metric;
  };

  /// curves    of the target; some may have no segment.
  /// segments  between samples, each following a curve. InputError: one that names no sample or no curve, width < 0,
  ///           tau outside [0, 1].
  CreaseEnergy(const FeatureCurves& curves, std::vector<CreaseSegment> segments, std::size_t num_samples, double width,
               double tangential_weight);

  /// Marks the ends of all segments of each curve on which at least one end may move.
  ///
  /// moves    called with the number of a sample; true if it may move.
  /// is_used  one entry per sample; set to 1 at these ends, left as it is elsewhere.
  void mark_moving_curves(const std::function<bool(Index sample)>& moves, std::vector<std::uint8_t>& is_used) const;

  /// Returns the same energy over other samples, some of which are fixed. Curves on which none moves are left out. On
  /// the others, segments between two fixed samples are known to the correspondences, but have none themselves.
  ///
  /// numbers  new number of each sample; kNoIndex if it has none. Those that `mark_moving_curves` marks must have one.
  /// is_free  of each new sample: 1 if it moves.
  CreaseEnergy part(std::span<const Index> numbers, std::vector<std::uint8_t> is_free) const;

  /// Finds the correspondences for these samples and freezes them.
  void assign(std::span<const Vec3> samples);

  /// Returns the links of a sample; each link is listed at both of its ends.
  std::span<const Index> links_at(std::size_t sample) const {
    return {link_numbers_.data() + offsets_[sample], offsets_[sample + 1] - offsets_[sample]};
  }
  const Link& link(Index number) const { return links_[number]; }
  std::span<const CreaseSegment> segments() const { return segments_; }
  /// True if an end of a segment may move.
  bool moves(const std::array<Index, 2>& ends) const {
    return is_free_.empty() || is_free_[ends[0]] != 0 || is_free_[ends[1]] != 0;
  }

 private:
  CreaseEnergy() = default;

  struct Curve {
    std::vector<Vec3> points;  ///< vertices of T's polyline
    ClosestPoint tree;         ///< tree over its segments
    bool closed;
    std::vector<Index> segments;  ///< segments of S
    std::vector<Index> ends;      ///< samples at which exactly one of these segments ends: two if the curve is open
  };

  /// Returns true if an end of one of the curve's segments may move.
  template <class Moves>
  bool is_moving(const Curve& curve, const Moves& moves) const;

  void link_target(const Curve& curve, std::span<const Vec3> samples);
  void link_creases(const Curve& curve, std::span<const Vec3> samples);
  void link_ends(const Curve& curve, std::span<const Vec3> samples);
  void add_link(const Link& link) {
    if (moves(link.ends)) links_.push_back(link);
  }
  Mat3 metric(const Curve& curve, Index segment, const Vec3& closest) const;

  std::vector<Curve> curves_;
  std::vector<CreaseSegment> segments_;
  double width_ = 0, tau_ = 0;
  std::vector<std::uint8_t> is_free_;  ///< of each sample; empty: all are
  std::vector<Link> links_;
  std::vector<std::size_t> offsets_;  ///< where each sample begins in link_numbers_
  std::vector<Index> link_numbers_;
};

}  // namespace subvol::internal
