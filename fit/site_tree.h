// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/types.h"

#include <array>
#include <cstddef>
#include <limits>
#include <span>
#include <vector>

namespace subvol {

/// Nearest of a set of sites, by a tree of bounding boxes with eight children per box and eight sites per leaf.
///
/// Sites are in an order in which every 8^k in a row lie close together, so the tree needs no pointers: box b of a level
/// holds boxes 8 b .. 8 b + 7 of the level below. Moved sites only need their boxes computed again (`refit`).
class SiteTree {
 public:
  struct Nearest {
    Index site = kNoIndex;
    double squared_distance = std::numeric_limits<double>::infinity();
  };

  struct Ball {
    Vec3 centre;
    double squared_radius;
  };

  SiteTree() = default;
  /// Sites are finite; equal ones are allowed. Cost: n log n, about 0.1 microseconds a site.
  explicit SiteTree(std::span<const Vec3> sites);

  /// Takes the sites' new positions (as many as before), keeping their order. Cost: one pass. Queries stay exact for any
  /// movement, and become slower as neighbours drift apart: `looseness` says how far.
  void refit(std::span<const Vec3> sites);
  /// Sum of the leaf boxes' diagonals over that of the build: 1 where nothing has moved.
  double looseness() const { return built_extent_ > 0 ? extent_ / built_extent_ : 1; }

  std::size_t num_sites() const { return num_sites_; }

  /// The site nearest to a point, of equally near ones the one with the lowest number.
  ///
  /// bound    squared distance beyond which sites do not matter. The result is the same for every bound that is at least
  ///          the squared distance of the nearest site; where it is smaller, the result may be kNoIndex.
  Nearest nearest(const Vec3& point, double bound = std::numeric_limits<double>::infinity()) const;

  /// Appends to `sites` the sites that lie in one of the balls (their borders included), in no particular order.
  /// returns whether there were at most `max_count`; if not, `sites` holds some of them.
  bool gather(std::span<const Ball> balls, std::size_t max_count, std::vector<Index>& sites) const;

 private:
  static constexpr int kWidth = 8;
  using Lanes = std::array<double, kWidth>;
  struct alignas(64) Leaf {
    Lanes x, y, z;
    std::array<Index, kWidth> sites;
  };
  struct alignas(64) Boxes {
    Lanes low[3], high[3];
  };

  static void leaf_distances(const Leaf& leaf, const Vec3& point, double* distances);
  static void box_distances(const Boxes& boxes, const Vec3& point, double* distances);
  int num_levels() const { return static_cast<int>(level_offsets_.size()) - 1; }
  void compute_leaves(std::span<const Vec3> sites);
  void compute_boxes();

  std::size_t num_sites_ = 0;
  std::vector<Index> order_;
  std::vector<Leaf> leaves_;
  std::vector<Boxes> boxes_;                ///< level by level, lowest first
  std::vector<std::size_t> level_offsets_;  ///< of `boxes_`
  double extent_ = 0, built_extent_ = 0;
};

}  // namespace subvol
