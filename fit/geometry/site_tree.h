// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/simd/wide.h"
#include "subvol/base/types.h"

#include <cstddef>
#include <limits>
#include <span>
#include <vector>

namespace subvol {

/// Nearest of a set of sites, by a tree of bounding boxes with eight children per box and eight sites per leaf.
///
/// Sites are put in an order in which every 8^k in a row lie close together, so the tree needs no pointers: box b of a
/// level holds boxes 8 b .. 8 b + 7 of the level below. A site's rank in that order is its *place*: places, not site
/// numbers, are what queries return, as things near each other in space are then near each other in memory. Moved sites
/// only need their boxes computed again (`refit`).
class SiteTree {
 public:
  struct Nearest {
    Index place = kNoIndex;
    double squared_distance = std::numeric_limits<double>::infinity();
  };
  struct Ball {
    Vec3 centre;
    double squared_radius;
  };

  SiteTree() = default;
  /// Sites are finite; equal ones are allowed. Cost: n log n, about 0.2 microseconds a site.
  explicit SiteTree(std::span<const Vec3> sites);

  /// Takes the sites' new positions (as many as before), keeping their order. Cost: one pass. Queries stay exact for
  /// any movement, and become slower as neighbours drift apart: `looseness` says how far.
  void refit(std::span<const Vec3> sites);
  /// Sum of the leaf boxes' diagonals over that of the build: 1 where nothing has moved.
  double looseness() const { return built_extent_ > 0 ? extent_ / built_extent_ : 1; }

  std::size_t num_sites() const { return sites_.size(); }
  Index site(Index place) const { return sites_[place]; }
  const Vec3& position(Index place) const { return positions_[place]; }

  /// The site nearest to a point, of equally near ones the one with the lowest number.
  ///
  /// bound    squared distance beyond which sites do not matter. The result is the same for every bound of at least the
  ///          squared distance of the nearest site; with a smaller one it may be kNoIndex.
  Nearest nearest(const Vec3& point, double bound = std::numeric_limits<double>::infinity()) const;

  /// Appends to `places` the sites that lie in one of the balls (their borders included), in no particular order.
  /// returns whether there were at most `max_count`; if not, `places` holds some of them.
  bool gather(std::span<const Ball> balls, std::size_t max_count, std::vector<Index>& places) const;

 private:
  struct Leaf {
    Wide position[3];
  };
  struct Boxes {
    Wide low[3], high[3];
  };

  static void leaf_distances(const Leaf& leaf, const Vec3& point, Wide& squared);
  static void box_distances(const Boxes& boxes, const Vec3& point, Wide& squared);
  int num_levels() const { return static_cast<int>(level_offsets_.size()) - 1; }
  void compute_leaves();
  void compute_boxes();

  std::vector<Index> sites_;     ///< by place
  std::vector<Vec3> positions_;  ///< by place
  std::vector<Leaf> leaves_;
  std::vector<Boxes> boxes_;                ///< level by level, lowest first
  std::vector<std::size_t> level_offsets_;  ///< of `boxes_`
  double extent_ = 0, built_extent_ = 0;
};

}  // namespace subvol
