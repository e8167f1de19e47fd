// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/features/feature_curves.h"
#include "fit/geometry/closest_point.h"
#include "subvol/base/types.h"

#include <array>
#include <cstddef>
#include <span>
#include <vector>

namespace subvol {

/// Squared distance between crease curves of the fitted surface S and the feature curves of the target T that they
/// follow; both ways, with frozen correspondences. An addition to a `SurfaceTerm`, which scales it as the rest of E_S.
///
///   E_C = width (sum_k b_k (y_k - s(y_k))^T M (y_k - s(y_k)) + sum_q c_q (x_q - t(x_q))^T M (x_q - t(x_q)))
///   M = I - (1 - tau) d d^T,  d: direction of T's curve; M = I where the closest point is an end of it
///
/// y_k, b_k   points of T's curves and the length each stands for;  s(y): closest point of S's curve
/// x_q, c_q   points of S's curves with their lengths;  t(x): closest point of T's curve
/// width      a crease counts as much as a strip of the surface so wide
///
/// An open curve's ends are also tied to each other with M = I and the length of S's last segment, so that creases end
/// where T's do.
///
/// Each curve of S knows its curve of T: nothing is drawn to a neighbouring edge, however close.
class CreaseEnergy {
 public:
  /// A point of T tied to a point of one segment of S: (1 - at) z_0 + at z_1.
  struct Link {
    std::array<Index, 2> ends;
    double at, weight;
    Vec3 point;
    Mat3 metric;
  };

  /// curves    of the target, those without a segment allowed.
  /// segments  between samples, each following a curve. InputError: one that names no sample or no curve, width < 0,
  ///           tau outside [0, 1].
  CreaseEnergy(const FeatureCurves& curves, std::vector<CreaseSegment> segments, std::size_t num_samples, double width,
               double tangential_weight);

  /// Finds what corresponds to the samples, and freezes it.
  void assign(std::span<const Vec3> samples);

  /// Links that pull at a sample; each stands at both of its ends.
  std::span<const Index> links_at(std::size_t sample) const {
    return {link_numbers_.data() + offsets_[sample], offsets_[sample + 1] - offsets_[sample]};
  }
  const Link& link(Index number) const { return links_[number]; }
  std::span<const CreaseSegment> segments() const { return segments_; }

 private:
  struct Curve {
    std::vector<Vec3> points;     ///< of T's polyline
    ClosestPoint tree;            ///< of its segments
    bool closed;
    std::vector<Index> segments;  ///< of S
    std::vector<Index> ends;      ///< samples that end one of these segments only: two where the curve is open
  };

  void link_target(const Curve& curve, std::span<const Vec3> samples);
  void link_creases(const Curve& curve, std::span<const Vec3> samples);
  void link_ends(const Curve& curve, std::span<const Vec3> samples);
  Mat3 metric(const Curve& curve, Index segment, const Vec3& closest) const;

  std::vector<Curve> curves_;
  std::vector<CreaseSegment> segments_;
  double width_, tau_;
  std::vector<Link> links_;
  std::vector<std::size_t> offsets_;  ///< of each sample in link_numbers_
  std::vector<Index> link_numbers_;
};

}  // namespace subvol
