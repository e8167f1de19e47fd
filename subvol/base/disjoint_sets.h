// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <vector>

namespace subvol::internal {

/// Sets of the numbers 0 .. n - 1 that are joined one by one (union-find). Each set is known by its least member, so
/// that results do not depend on the order of the joins. Cost: almost constant for each call.
class DisjointSets {
 public:
  /// Begins with a set for each number.
  explicit DisjointSets(std::size_t n) : parent_(n) { std::iota(parent_.begin(), parent_.end(), Index{0}); }

  std::size_t size() const { return parent_.size(); }
  /// Returns the least member of the set of i, in [0, n).
  Index of(Index i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  /// Makes the sets of a and b one.
  void join(Index a, Index b) {
    const Index x = of(a), y = of(b);
    parent_[std::max(x, y)] = std::min(x, y);
  }
  /// Numbers the sets from 0 in the order of their least members. Returns how many there are.
  /// numbers  receives the number of the set of each member.
  std::size_t number(std::vector<Index>& numbers) {
    Index count = 0;
    numbers.resize(parent_.size());
    for (std::size_t i = 0; i < parent_.size(); ++i) {
      const Index least = of(static_cast<Index>(i));
      numbers[i] = static_cast<std::size_t>(least) == i ? count++ : numbers[least];
    }
    return static_cast<std::size_t>(count);
  }

 private:
  std::vector<Index> parent_;
};

}  // namespace subvol::internal
