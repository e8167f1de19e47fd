// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/features/curve_parts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <optional>
#include <utility>

namespace subvol::internal {

namespace {

// Lengths are in units of h.
constexpr double kLeastPartLength = 3;
constexpr double kLeastPartGap = 1;          // between two parts
constexpr double kLeastFollowedShare = 0.5;  // of the curve, by all parts

/// A part of a curve, from one place to another.
using Interval = std::pair<double, double>;

double length_of(const Interval& interval) { return interval.second - interval.first; }

/// Returns the places at which a part may begin or end: the ends of an interval, some near them, and some that divide
/// it evenly; ascending.
std::vector<double> places_in(const Interval& all, double h) {
  constexpr std::array kNearEnds = {1.0, 2.0, 3.0, 4.5, 6.0};
  constexpr int kDivisions = 8;  // equal parts of the interval
  std::vector<double> places = {all.first, all.second};
  for (const double near : kNearEnds)
    if (near * h < length_of(all)) places.insert(places.end(), {all.first + near * h, all.second - near * h});
  for (int k = 1; k < kDivisions; ++k) places.push_back(all.first + length_of(all) * k / kDivisions);
  std::ranges::sort(places);
  return places;
}

/// Looks for the parts of one curve.
class PartSearch {
 public:
  PartSearch(const CurveSearch& search, const RoutingGraph& graph, const FeatureCurve& curve, Index c,
             const Occupied& occupied)
      : search_(search), graph_(graph), curve_(curve), c_(c), h_(graph.edge_length()), occupied_(occupied) {}

  std::vector<PartPath> run() {
    const double length = curve_.length();
    std::vector<Interval> left = {{0, length}};
    if (curve_.closed()) left = {cut_open()};
    while (!left.empty()) {
      const Interval all = left.back();
      left.pop_back();
      const std::optional<Interval> longest = longest_in(all);
      if (!longest) continue;
      left.push_back({all.first, longest->first - kLeastPartGap * h_});
      left.push_back({longest->second + kLeastPartGap * h_, all.second});
    }
    double followed = 0;
    for (PartPath& found : found_) {
      followed += found.part.to - found.part.from;
      const double turns = std::floor(found.part.from / length) * length;
      found.part.from -= turns;
      found.part.to -= turns;
    }
    if (followed < kLeastFollowedShare * length) return {};
    std::ranges::sort(found_, {}, [](const PartPath& found) { return found.part.from; });
    return std::move(found_);
  }

 private:
  bool find(const Interval& part) {
    std::vector<Index> path = search_.find_part(c_, part.first, part.second, occupied_);
    if (path.empty()) return false;
    occupied_.add(graph_, path);
    found_.push_back({{c_, part.first, part.second}, std::move(path)});
    return true;
  }

  /// Finds the longest part in an interval, if there is one.
  std::optional<Interval> longest_in(const Interval& all) {
    const std::vector<double> places = places_in(all, h_);
    std::vector<Interval> parts;
    for (const double from : places)
      for (const double to : places)
        if (to - from >= kLeastPartLength * h_) parts.push_back({from, to});
    std::ranges::stable_sort(parts, std::greater{}, length_of);
    for (const Interval& part : parts)
      if (find(part)) return part;
    return std::nullopt;
  }

  /// Finds the longest part of a closed curve, if one is long enough. Returns what is left.
  Interval cut_open() {
    constexpr int kClosedCurveStarts = 8;  // that are tried, evenly spread along the curve
    const double length = curve_.length();
    std::vector<Interval> parts;
    for (int k = 0; k < kClosedCurveStarts; ++k) {
      const double from = length * k / kClosedCurveStarts;
      for (const double to : places_in({from, from + length}, h_))
        if (to - from >= std::max(kLeastPartLength * h_, kLeastFollowedShare * length) && to - from < length)
          parts.push_back({from, to});
    }
    std::ranges::stable_sort(parts, std::greater{}, length_of);
    for (const Interval& part : parts)
      if (find(part)) return {part.second + kLeastPartGap * h_, part.first + length - kLeastPartGap * h_};
    return {0, 0};
  }

  const CurveSearch& search_;
  const RoutingGraph& graph_;
  const FeatureCurve& curve_;
  Index c_;
  double h_;
  Occupied occupied_;
  std::vector<PartPath> found_;
};

}  // namespace

std::vector<PartPath> find_parts(const CurveSearch& search, const RoutingGraph& graph, const FeatureCurves& curves,
                                 Index c, const Occupied& occupied) {
  const double h = graph.edge_length();
  if (!(h > 0) || curves.curves[c].length() < kLeastPartLength * h) return {};
  return PartSearch(search, graph, curves.curves[c], c, occupied).run();
}

}  // namespace subvol::internal
