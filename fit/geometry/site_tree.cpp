// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/geometry/site_tree.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <numeric>

namespace subvol::internal {

namespace {

constexpr std::size_t kBranch = kWide;
constexpr int kMaxLevels = 12;      // 8^12 boxes
constexpr double kFarAway = 1e200;  // coordinate in unused lanes; its square is infinite

int longest_axis(std::span<const Vec3> sites, std::span<const Index> order) {
  Vec3 low = sites[order[0]], high = low;
  for (Index i : order) {
    low = low.cwiseMin(sites[i]);
    high = high.cwiseMax(sites[i]);
  }
  int axis = 0;
  (high - low).maxCoeff(&axis);
  return axis;
}

/// Orders the sites so that every `unit` in a row form a subtree, and likewise within each unit.
void order_sites(std::span<const Vec3> sites, std::span<Index> order, std::size_t unit) {
  if (order.size() <= kBranch) return;
  while (unit >= order.size()) unit /= kBranch;
  const std::size_t num_units = (order.size() + unit - 1) / unit;
  const std::size_t half = (num_units / 2) * unit;
  const int axis = longest_axis(sites, order);
  std::nth_element(
      order.begin(), order.begin() + static_cast<std::ptrdiff_t>(half), order.end(),
      [&](Index a, Index b) { return sites[a][axis] != sites[b][axis] ? sites[a][axis] < sites[b][axis] : a < b; });
  order_sites(sites, order.first(half), unit);
  order_sites(sites, order.subspan(half), unit);
}

}  // namespace

SiteTree::SiteTree(std::span<const Vec3> sites) : sites_(sites.size()) {
  std::iota(sites_.begin(), sites_.end(), 0);
  std::size_t unit = kBranch;
  while (unit < sites_.size()) unit *= kBranch;
  order_sites(sites, sites_, unit);

  leaves_.resize((sites_.size() + kBranch - 1) / kBranch);
  std::size_t num_boxes = 0, count = leaves_.size();
  level_offsets_.push_back(0);
  do {
    count = (count + kBranch - 1) / kBranch;
    num_boxes += count;
    level_offsets_.push_back(num_boxes);
  } while (count > 1);
  boxes_.resize(num_boxes);
  refit(sites);
  built_extent_ = extent_;
}

void SiteTree::refit(std::span<const Vec3> sites) {
  positions_.resize(sites_.size());
  for (std::size_t place = 0; place < sites_.size(); ++place) positions_[place] = sites[sites_[place]];
  compute_leaves();
  compute_boxes();
}

void SiteTree::compute_leaves() {
  for (std::size_t l = 0; l < leaves_.size(); ++l)
    for (int k = 0; k < kWide; ++k) {
      const std::size_t place = l * kBranch + k;
      for (int axis = 0; axis < 3; ++axis)
        leaves_[l].position[axis][k] = place < sites_.size() ? positions_[place][axis] : kFarAway;
    }
}

void SiteTree::compute_boxes() {
  extent_ = 0;
  std::vector<Vec3> lows, highs, low_parents, high_parents;
  for (std::size_t place = 0; place < positions_.size(); place += kBranch) {
    Vec3 low = positions_[place], high = low;
    for (std::size_t k = place; k < std::min(place + kBranch, positions_.size()); ++k) {
      low = low.cwiseMin(positions_[k]);
      high = high.cwiseMax(positions_[k]);
    }
    lows.push_back(low);
    highs.push_back(high);
    extent_ += (high - low).norm();
  }
  for (std::size_t level = 0; level + 1 < level_offsets_.size(); ++level) {
    low_parents.clear();
    high_parents.clear();
    for (std::size_t b = level_offsets_[level]; b < level_offsets_[level + 1]; ++b) {
      const std::size_t first = (b - level_offsets_[level]) * kBranch;
      Vec3 low = Vec3::Constant(kFarAway), high = -low;
      for (std::size_t k = 0; k < kBranch; ++k) {
        const bool used = first + k < lows.size();
        for (int axis = 0; axis < 3; ++axis) {
          boxes_[b].low[axis][k] = used ? lows[first + k][axis] : kFarAway;
          boxes_[b].high[axis][k] = used ? highs[first + k][axis] : kFarAway;
        }
        if (!used) continue;
        low = low.cwiseMin(lows[first + k]);
        high = high.cwiseMax(highs[first + k]);
      }
      low_parents.push_back(low);
      high_parents.push_back(high);
    }
    lows.swap(low_parents);
    highs.swap(high_parents);
  }
}

void SiteTree::leaf_distances(const Leaf& leaf, const Vec3& point, Wide& squared) {
  const Wide dx = leaf.position[0] - point[0], dy = leaf.position[1] - point[1], dz = leaf.position[2] - point[2];
  squared = dx * dx + dy * dy + dz * dz;
}

void SiteTree::box_distances(const Boxes& boxes, const Vec3& point, Wide& squared) {
  squared = Wide{};
  for (int axis = 0; axis < 3; ++axis) {
    Wide gap = boxes.low[axis] - point[axis];
    take_higher(gap, point[axis] - boxes.high[axis]);
    take_higher(gap, Wide{});
    squared += gap * gap;
  }
}

SiteTree::Nearest SiteTree::nearest(const Vec3& point, double bound) const {
  Nearest best;
  if (sites_.empty()) return best;
  // Unused lanes are infinitely far away: no limit admits them.
  double limit = std::min(bound * kSquaredDistanceSlack, std::numeric_limits<double>::max());
  struct Entry {
    double distance;
    std::uint32_t number;
    std::int32_t level;  // -1: a leaf
  };
  Entry stack[kMaxLevels * kWide];
  int size = 0;
  stack[size++] = {0, 0, num_levels() - 1};
  Wide d;
  while (size > 0) {
    const Entry entry = stack[--size];
    if (entry.distance > limit) continue;
    if (entry.level < 0) {
      leaf_distances(leaves_[entry.number], point, d);
      for (unsigned lanes = lanes_within(d, limit); lanes != 0; lanes &= lanes - 1) {
        const int k = std::countr_zero(lanes);
        const Index place = static_cast<Index>(entry.number) * kWide + k;
        if (d[k] < best.squared_distance || (d[k] == best.squared_distance && sites_[place] < sites_[best.place]))
          best = {place, d[k]};
      }
      limit = std::min(limit, best.squared_distance * kSquaredDistanceSlack);
      continue;
    }
    box_distances(boxes_[level_offsets_[entry.level] + entry.number], point, d);
    // The nearest child is pushed last, so that it is visited first.
    const int first = size;
    for (unsigned lanes = lanes_within(d, limit); lanes != 0; lanes &= lanes - 1) {
      const int k = std::countr_zero(lanes);
      int place = size++;
      for (; place > first && stack[place - 1].distance < d[k]; --place) stack[place] = stack[place - 1];
      stack[place] = {d[k], entry.number * kWide + static_cast<std::uint32_t>(k), entry.level - 1};
    }
  }
  return best;
}

bool SiteTree::gather(std::span<const Ball> balls, std::size_t max_count, std::vector<Index>& places) const {
  if (sites_.empty()) return true;
  struct Entry {
    std::uint32_t number;
    std::int32_t level;
  };
  Entry stack[kMaxLevels * kWide];
  int size = 0;
  std::size_t count = 0;
  stack[size++] = {0, num_levels() - 1};
  Wide d;
  while (size > 0) {
    const Entry entry = stack[--size];
    const bool leaf = entry.level < 0;
    unsigned lanes = 0;
    for (const Ball& ball : balls) {
      if (leaf)
        leaf_distances(leaves_[entry.number], ball.center, d);
      else
        box_distances(boxes_[level_offsets_[entry.level] + entry.number], ball.center, d);
      lanes |= lanes_within(d, leaf ? ball.squared_radius : ball.squared_radius * kSquaredDistanceSlack);
    }
    if (leaf) count += static_cast<std::size_t>(std::popcount(lanes));
    if (count > max_count) return false;
    for (; lanes != 0; lanes &= lanes - 1) {
      const auto child = entry.number * kWide + static_cast<std::uint32_t>(std::countr_zero(lanes));
      if (leaf)
        places.push_back(static_cast<Index>(child));
      else
        stack[size++] = {child, entry.level - 1};
    }
  }
  return true;
}

}  // namespace subvol::internal
