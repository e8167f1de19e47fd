// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/features/crease_energy.h"

#include "subvol/base/error.h"
#include "subvol/fit/features/polyline.h"

#include <algorithm>
#include <map>
#include <string>
#include <utility>

namespace subvol::internal {

namespace {

/// Number of parts of a segment of T or S, each represented by its midpoint.
constexpr int kPointsPerSegment = 2;

/// Returns the position, from a (0) to b (1), of the point of the segment closest to p.
double place_on_segment(const Vec3& p, const Vec3& a, const Vec3& b) {
  const double squared = (b - a).squaredNorm();
  return squared > 0 ? std::clamp((p - a).dot(b - a) / squared, 0.0, 1.0) : 0.0;
}

}  // namespace

CreaseEnergy::CreaseEnergy(const FeatureCurves& curves, std::vector<CreaseSegment> segments, std::size_t num_samples,
                           double width, double tangential_weight)
    : segments_(std::move(segments)), width_(width), tau_(tangential_weight), offsets_(num_samples + 1, 0) {
  if (!(width >= 0)) throw InputError("CreaseEnergy: width must not be negative");
  if (!(tau_ >= 0 && tau_ <= 1)) throw InputError("CreaseEnergy: tangential_weight must be in [0, 1]");
  for (const FeatureCurve& curve : curves.curves)
    curves_.push_back({curve.points, polyline_tree(curve.points), curve.closed(), {}, {}});
  for (std::size_t s = 0; s < segments_.size(); ++s) {
    const CreaseSegment& segment = segments_[s];
    if (segment.curve < 0 || static_cast<std::size_t>(segment.curve) >= curves_.size())
      throw InputError("CreaseEnergy: a segment names curve " + std::to_string(segment.curve));
    for (Index end : segment.ends)
      if (end < 0 || static_cast<std::size_t>(end) >= num_samples)
        throw InputError("CreaseEnergy: a segment names sample " + std::to_string(end));
    curves_[segment.curve].segments.push_back(static_cast<Index>(s));
  }
  for (Curve& curve : curves_) {
    std::map<Index, int> count;
    for (Index s : curve.segments)
      for (Index end : segments_[s].ends) ++count[end];
    for (const auto& [sample, segments_there] : count)
      if (segments_there == 1) curve.ends.push_back(sample);
  }
}

template <class Moves>
bool CreaseEnergy::is_moving(const Curve& curve, const Moves& moves) const {
  return std::ranges::any_of(curve.segments,
                             [&](Index s) { return moves(segments_[s].ends[0]) || moves(segments_[s].ends[1]); });
}

void CreaseEnergy::mark_moving_curves(const std::function<bool(Index)>& moves,
                                      std::vector<std::uint8_t>& is_used) const {
  for (const Curve& curve : curves_) {
    if (!is_moving(curve, moves)) continue;
    for (const Index s : curve.segments)
      for (const Index end : segments_[s].ends) is_used[end] = 1;
  }
}

CreaseEnergy CreaseEnergy::part(std::span<const Index> numbers, std::vector<std::uint8_t> is_free) const {
  CreaseEnergy result;
  result.width_ = width_;
  result.tau_ = tau_;
  result.offsets_.assign(is_free.size() + 1, 0);
  const auto moves_there = [&](Index sample) { return numbers[sample] != kNoIndex && is_free[numbers[sample]] != 0; };
  for (const Curve& curve : curves_) {
    if (!is_moving(curve, moves_there)) continue;
    const auto number = static_cast<Index>(result.curves_.size());
    Curve own{curve.points, curve.tree, curve.closed, {}, {}};
    for (const Index s : curve.segments) {
      const auto [a, b] = segments_[s].ends;
      own.segments.push_back(static_cast<Index>(result.segments_.size()));
      result.segments_.push_back({{numbers[a], numbers[b]}, number});
    }
    for (const Index end : curve.ends) own.ends.push_back(numbers[end]);
    result.curves_.push_back(std::move(own));
  }
  result.is_free_ = std::move(is_free);
  return result;
}

/// Displacements along the curve count with tau only, those at the ends of an open curve fully.
Mat3 CreaseEnergy::metric(const Curve& curve, Index segment, const Vec3& closest) const {
  const Vec3 &a = curve.points[segment], &b = curve.points[segment + 1];
  const bool at_end = !curve.closed && (closest == curve.points.front() || closest == curve.points.back());
  const Vec3 d = (b - a).normalized();
  return at_end ? Mat3(Mat3::Identity()) : Mat3(Mat3::Identity() - (1 - tau_) * d * d.transpose());
}

void CreaseEnergy::link_target(const Curve& curve, std::span<const Vec3> samples) {
  TriangleMesh polyline;
  for (Index s : curve.segments) {
    const auto first = static_cast<Index>(polyline.positions.size());
    for (Index end : segments_[s].ends) polyline.positions.push_back(samples[end]);
    polyline.triangles.push_back({first, first + 1, first + 1});
  }
  const ClosestPoint tree(polyline);
  const auto add = [&](const Vec3& y, double length, const Mat3& m) {
    const ClosestPoint::Hit hit = tree.closest(y);
    const std::array<Index, 2> ends = segments_[curve.segments[hit.triangle]].ends;
    const double at = place_on_segment(hit.point, samples[ends[0]], samples[ends[1]]);
    add_link({ends, at, width_ * length, y, m});
  };
  for (std::size_t i = 0; i + 1 < curve.points.size(); ++i) {
    const Vec3 &a = curve.points[i], &b = curve.points[i + 1];
    const double length = (b - a).norm() / kPointsPerSegment;
    const Vec3 middle = 0.5 * (a + b);
    const Mat3 m = metric(curve, static_cast<Index>(i), middle);
    for (int k = 0; k < kPointsPerSegment; ++k) add(a + (b - a) * ((k + 0.5) / kPointsPerSegment), length, m);
  }
}

void CreaseEnergy::link_creases(const Curve& curve, std::span<const Vec3> samples) {
  for (Index s : curve.segments) {
    const std::array<Index, 2> ends = segments_[s].ends;
    const Vec3 &a = samples[ends[0]], &b = samples[ends[1]];
    const double length = (b - a).norm() / kPointsPerSegment;
    for (int k = 0; k < kPointsPerSegment; ++k) {
      const double at = (k + 0.5) / kPointsPerSegment;
      const ClosestPoint::Hit hit = curve.tree.closest(a + at * (b - a));
      add_link({ends, at, width_ * length, hit.point, metric(curve, hit.triangle, hit.point)});
    }
  }
}

void CreaseEnergy::link_ends(const Curve& curve, std::span<const Vec3> samples) {
  if (curve.closed || curve.ends.size() != 2) return;
  std::array<Index, 2> ends = {curve.ends[0], curve.ends[1]};
  const Vec3 &front = curve.points.front(), &back = curve.points.back();
  const auto apart = [&] { return (samples[ends[0]] - front).norm() + (samples[ends[1]] - back).norm(); };
  const double straight = apart();
  std::swap(ends[0], ends[1]);
  if (apart() > straight) std::swap(ends[0], ends[1]);
  for (Index s : curve.segments)
    for (int k = 0; k < 2; ++k)
      for (int e = 0; e < 2; ++e) {
        const std::array<Index, 2>& tips = segments_[s].ends;
        if (tips[k] != ends[e]) continue;
        const double length = (samples[tips[1]] - samples[tips[0]]).norm();
        add_link({tips, double(k), width_ * length, e == 0 ? front : back, Mat3::Identity()});
      }
}

void CreaseEnergy::assign(std::span<const Vec3> samples) {
  links_.clear();
  for (const Curve& curve : curves_) {
    if (curve.segments.empty()) continue;
    link_target(curve, samples);
    link_creases(curve, samples);
    link_ends(curve, samples);
  }
  std::fill(offsets_.begin(), offsets_.end(), 0);
  for (const Link& link : links_)
    for (Index end : link.ends) ++offsets_[end + 1];
  for (std::size_t i = 0; i + 1 < offsets_.size(); ++i) offsets_[i + 1] += offsets_[i];
  link_numbers_.resize(2 * links_.size());
  std::vector<std::size_t> next(offsets_.begin(), offsets_.end() - 1);
  for (std::size_t k = 0; k < links_.size(); ++k)
    for (Index end : links_[k].ends) link_numbers_[next[end]++] = static_cast<Index>(k);
}

}  // namespace subvol::internal
