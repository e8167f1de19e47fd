// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"
#include "subvol/fit/simd/wide.h"

#include <cstddef>
#include <limits>
#include <span>
#include <vector>

namespace subvol::internal {

/// Factor on squared distances that covers their rounding. By rounding, a box may be farther than a site in it: the
/// slack keeps the result independent of the bound.
inline constexpr double kSquaredDistanceSlack = 1 + 1e-14;

/// Finds the nearest of a set of sites, with a tree of bounding boxes: eight children per box, eight sites per leaf.
///
/// Sites are ordered so that every 8^k in a row lie close together, so the tree needs no pointers: box b of a level
/// holds boxes 8 b .. 8 b + 7 of the level below. A site's rank in that order is its *place*. Queries return places,
/// not site numbers, because sites close to each other in space are then close in memory. If sites move, only the boxes
/// are computed again (`refit`).
class SiteTree {
 public:
  struct Nearest {
    Index place = kNoIndex;
    double squared_distance = std::numeric_limits<double>::infinity();
  };
  struct Ball {
    Vec3 center;
    double squared_radius;
  };

  SiteTree() = default;
  /// Sites must be finite; equal ones are allowed. Cost: n log n, about 0.2 microseconds a site.
  explicit SiteTree(std::span<const Vec3> sites);

  /// Takes new positions of the sites (as many as before) and keeps their order. Cost: one pass. Queries stay exact for
  /// any movement and become slower as neighbors drift apart; `looseness` measures how far they have.
  void refit(std::span<const Vec3> sites);
  /// Sum of the leaf boxes' diagonals over that after the build: 1 if nothing has moved.
  double looseness() const { return built_extent_ > 0 ? extent_ / built_extent_ : 1; }

  std::size_t num_sites() const { return sites_.size(); }
  Index site(Index place) const { return sites_[place]; }
  const Vec3& position(Index place) const { return positions_[place]; }

  /// Returns the site nearest to a point; of equally near ones, that with the lowest number.
  ///
  /// bound    squared distance beyond which sites do not matter. The result is the same for every bound that is at
  ///          least the squared distance of the nearest site; with a smaller one it may be kNoIndex.
  Nearest nearest(const Vec3& point, double bound = std::numeric_limits<double>::infinity()) const;

  /// Appends to `places` the sites that lie in one of the closed balls, in no particular order.
  /// returns true if there are at most `max_count`; if not, `places` holds some of them.
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
  std::vector<std::size_t> level_offsets_;  ///< where each level begins in `boxes_`
  double extent_ = 0, built_extent_ = 0;
};

}  // namespace subvol::internal
