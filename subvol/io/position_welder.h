// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

namespace subvol::internal {

/// Makes one vertex of equal positions, because formats repeat a vertex in every triangle (STL), or wherever its normal
/// differs (glTF).
///
/// Many CAD programs write the rounding errors of a coordinate that is zero: 1.2e-17 in one triangle and -3e-33 in the
/// next one. Positions that differ only by such coordinates become one vertex, too.
class PositionWelder {
 public:
  /// Returns a provisional number of the vertex at a position; `take` replaces it by the final one.
  Index vertex(const Vec3& position) {
    const auto [it, is_new] = vertices_.try_emplace(key(position, 0), static_cast<Index>(positions_.size()));
    if (is_new) positions_.push_back(position);
    return it->second;
  }

  /// Returns the position of each vertex, the first one given of those that became one vertex.
  /// corners  the numbers that `vertex` returned; they become the final numbers of the vertices.
  std::vector<Vec3> take(std::vector<Index>& corners) {
    const std::vector<Index> first = first_of_equal();
    std::vector<Index> number(positions_.size());
    std::vector<Vec3> kept;
    for (std::size_t v = 0; v < positions_.size(); ++v) {
      const auto f = static_cast<std::size_t>(first[v]);
      number[v] = f == v ? static_cast<Index>(kept.size()) : number[f];
      if (f == v) kept.push_back(positions_[v]);
    }
    for (Index& corner : corners) corner = number[static_cast<std::size_t>(corner)];
    return kept;
  }

 private:
  using Key = std::array<double, 3>;

  /// Coordinates up to this share of the largest one are rounding errors: half the last digit of single precision.
  static constexpr double kZeroShare = 0x1p-24;

  static Key key(const Vec3& position, double zero) {
    Key key;
    for (int j = 0; j < 3; ++j)
      key[static_cast<std::size_t>(j)] = std::abs(position[j]) <= zero ? 0.0 : position[j];  // -0.0 becomes 0.0, too
    return key;
  }

  /// Returns the first vertex at the place of each vertex; rounding errors of zero do not count.
  std::vector<Index> first_of_equal() {
    double largest = 0;
    for (const Vec3& p : positions_) largest = std::max(largest, p.cwiseAbs().maxCoeff());
    std::vector<Index> first(positions_.size());
    for (std::size_t v = 0; v < positions_.size(); ++v) {
      const auto number = static_cast<Index>(v);
      const auto [it, is_new] = vertices_.try_emplace(key(positions_[v], kZeroShare * largest), number);
      // The vertex whose coordinates are exactly zero may come later than others at its place.
      if (it->second > number) it->second = number;
      first[v] = it->second;
    }
    return first;
  }

  std::map<Key, Index> vertices_;
  std::vector<Vec3> positions_;
};

}  // namespace subvol::internal
