// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/site_tree.h"

#include <algorithm>
#include <bit>
#include <cstdint>

#ifdef __AVX512F__
#include <immintrin.h>
#endif

namespace subvol {

namespace {

constexpr std::size_t kLeafSize = 8;
constexpr double kFarAway = 1e200;  // of the lanes that hold no site: its square is infinite
constexpr int kMaxLevels = 12;      // 8^12 boxes

// A box may be farther by rounding than a site in it: the slack keeps the result independent of the bound.
constexpr double kSlack = 1 + 1e-14;

/// Bit k tells whether distances[k] <= limit. `distances` is aligned to its eight lanes.
unsigned lanes_within(const double* distances, double limit) {
#ifdef __AVX512F__
  return _mm512_cmp_pd_mask(_mm512_load_pd(distances), _mm512_set1_pd(limit), _CMP_LE_OQ);
#else
  unsigned lanes = 0;
  for (unsigned k = 0; k < kLeafSize; ++k) lanes |= static_cast<unsigned>(distances[k] <= limit) << k;
  return lanes;
#endif
}

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

/// Orders sites so that every `unit` in a row form a subtree, and the same within each unit.
void order_sites(std::span<const Vec3> sites, std::span<Index> order, std::size_t unit) {
  while (unit >= order.size() && unit > kLeafSize) unit /= kLeafSize;
  if (order.size() <= kLeafSize) return;
  const std::size_t num_units = (order.size() + unit - 1) / unit;
  const std::size_t half = (num_units / 2) * unit;
  const int axis = longest_axis(sites, order);
  std::nth_element(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(half), order.end(), [&](Index a, Index b) {
    return sites[a][axis] != sites[b][axis] ? sites[a][axis] < sites[b][axis] : a < b;
  });
  order_sites(sites, order.first(half), unit);
  order_sites(sites, order.subspan(half), unit);
}

}  // namespace

SiteTree::SiteTree(std::span<const Vec3> sites) : num_sites_(sites.size()), order_(sites.size()) {
  for (std::size_t i = 0; i < order_.size(); ++i) order_[i] = static_cast<Index>(i);
  std::size_t unit = kLeafSize;
  while (unit < order_.size()) unit *= kLeafSize;
  order_sites(sites, order_, unit);

  leaves_.resize((num_sites_ + kLeafSize - 1) / kLeafSize);
  std::size_t num_boxes = 0, count = leaves_.size();
  level_offsets_.push_back(0);
  do {
    count = (count + kLeafSize - 1) / kLeafSize;
    num_boxes += count;
    level_offsets_.push_back(num_boxes);
  } while (count > 1);
  boxes_.resize(num_boxes);
  refit(sites);
  built_extent_ = extent_;
}

void SiteTree::refit(std::span<const Vec3> sites) {
  compute_leaves(sites);
  compute_boxes();
}

void SiteTree::compute_leaves(std::span<const Vec3> sites) {
  for (std::size_t l = 0; l < leaves_.size(); ++l)
    for (std::size_t k = 0; k < kLeafSize; ++k) {
      const std::size_t slot = l * kLeafSize + k;
      const bool used = slot < num_sites_;
      const Index site = used ? order_[slot] : kNoIndex;
      leaves_[l].sites[k] = site;
      leaves_[l].x[k] = used ? sites[site][0] : kFarAway;
      leaves_[l].y[k] = used ? sites[site][1] : kFarAway;
      leaves_[l].z[k] = used ? sites[site][2] : kFarAway;
    }
}

void SiteTree::compute_boxes() {
  extent_ = 0;
  for (std::size_t level = 0; level + 1 < level_offsets_.size(); ++level) {
    const std::size_t num_children = level == 0 ? leaves_.size() : level_offsets_[level] - level_offsets_[level - 1];
    for (std::size_t b = level_offsets_[level]; b < level_offsets_[level + 1]; ++b)
      for (std::size_t k = 0; k < kLeafSize; ++k) {
        const std::size_t child = (b - level_offsets_[level]) * kLeafSize + k;
        Vec3 low = Vec3::Constant(kFarAway), high = low;
        if (child < num_children && level > 0) {
          const Boxes& boxes = boxes_[level_offsets_[level - 1] + child];
          for (int axis = 0; axis < 3; ++axis) {
            low[axis] = *std::min_element(boxes.low[axis].begin(), boxes.low[axis].end());
            high[axis] = -kFarAway;
            for (double h : boxes.high[axis])
              if (h < kFarAway) high[axis] = std::max(high[axis], h);
          }
        } else if (child < num_children) {
          const Leaf& leaf = leaves_[child];
          const std::size_t used = std::min(kLeafSize, num_sites_ - child * kLeafSize);
          const Lanes* coordinates[3] = {&leaf.x, &leaf.y, &leaf.z};
          for (int axis = 0; axis < 3; ++axis) {
            const double* c = coordinates[axis]->data();
            low[axis] = *std::min_element(c, c + used);
            high[axis] = *std::max_element(c, c + used);
          }
          extent_ += (high - low).norm();
        }
        for (int axis = 0; axis < 3; ++axis) {
          boxes_[b].low[axis][k] = low[axis];
          boxes_[b].high[axis][k] = high[axis];
        }
      }
  }
}

void SiteTree::leaf_distances(const Leaf& leaf, const Vec3& point, double* distances) {
  for (int k = 0; k < kWidth; ++k) {
    const double dx = leaf.x[k] - point[0], dy = leaf.y[k] - point[1], dz = leaf.z[k] - point[2];
    distances[k] = dx * dx + dy * dy + dz * dz;
  }
}

void SiteTree::box_distances(const Boxes& boxes, const Vec3& point, double* distances) {
  for (int k = 0; k < kWidth; ++k) {
    double sum = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const double below = boxes.low[axis][k] - point[axis], above = point[axis] - boxes.high[axis][k];
      double gap = below > above ? below : above;
      gap = gap > 0 ? gap : 0;
      sum += gap * gap;
    }
    distances[k] = sum;
  }
}

SiteTree::Nearest SiteTree::nearest(const Vec3& point, double bound) const {
  Nearest best;
  if (num_sites_ == 0) return best;
  double limit = std::min(bound * kSlack, std::numeric_limits<double>::max());  // lanes without a box are infinitely far
  struct Entry {
    double distance;
    std::uint32_t node;
    std::int32_t level;  // -1: a leaf
  };
  Entry stack[kMaxLevels * kWidth];
  int size = 0;
  stack[size++] = {0, 0, num_levels() - 1};
  alignas(64) double d[kWidth];
  while (size > 0) {
    const Entry entry = stack[--size];
    if (entry.distance > limit) continue;
    if (entry.level < 0) {
      const Leaf& leaf = leaves_[entry.node];
      leaf_distances(leaf, point, d);
      for (unsigned lanes = lanes_within(d, limit); lanes != 0; lanes &= lanes - 1) {
        const int k = std::countr_zero(lanes);
        if (d[k] < best.squared_distance || (d[k] == best.squared_distance && leaf.sites[k] < best.site))
          best = {leaf.sites[k], d[k]};
      }
      limit = std::min(limit, best.squared_distance * kSlack);
      continue;
    }
    box_distances(boxes_[level_offsets_[entry.level] + entry.node], point, d);
    // The nearest child comes last onto the stack, so it is visited first.
    const int first = size;
    for (unsigned lanes = lanes_within(d, limit); lanes != 0; lanes &= lanes - 1) {
      const int k = std::countr_zero(lanes);
      int place = size++;
      for (; place > first && stack[place - 1].distance < d[k]; --place) stack[place] = stack[place - 1];
      stack[place] = {d[k], entry.node * kWidth + static_cast<std::uint32_t>(k), entry.level - 1};
    }
  }
  return best;
}

bool SiteTree::gather(std::span<const Ball> balls, std::size_t max_count, std::vector<Index>& sites) const {
  if (num_sites_ == 0) return true;
  struct Entry {
    std::uint32_t node;
    std::int32_t level;
  };
  Entry stack[kMaxLevels * kWidth];
  int size = 0;
  std::size_t count = 0;
  stack[size++] = {0, num_levels() - 1};
  alignas(64) double d[kWidth];
  while (size > 0) {
    const Entry entry = stack[--size];
    unsigned lanes = 0;
    for (const Ball& ball : balls) {
      if (entry.level < 0)
        leaf_distances(leaves_[entry.node], ball.centre, d);
      else
        box_distances(boxes_[level_offsets_[entry.level] + entry.node], ball.centre, d);
      lanes |= lanes_within(d, entry.level < 0 ? ball.squared_radius : ball.squared_radius * kSlack);
    }
    if (entry.level < 0) {
      count += static_cast<std::size_t>(std::popcount(lanes));
      if (count > max_count) return false;
    }
    for (; lanes != 0; lanes &= lanes - 1) {
      const int k = std::countr_zero(lanes);
      if (entry.level < 0)
        sites.push_back(leaves_[entry.node].sites[k]);
      else
        stack[size++] = {entry.node * kWidth + static_cast<std::uint32_t>(k), entry.level - 1};
    }
  }
  return true;
}

}  // namespace subvol
