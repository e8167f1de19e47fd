// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <map>
#include <set>
#include <span>

namespace subvol::internal {

/// Numbers of groups for formats that want positive ones: those that are positive are kept, each other one is replaced
/// by the first positive number that is free.
class PositiveNumbers {
 public:
  /// numbers: all that there are, so that none of them is given to another.
  explicit PositiveNumbers(std::span<const int> numbers) {
    for (const int number : numbers)
      if (number > 0) taken_.insert(number);
  }
  int of(int number) {
    if (number > 0) return number;
    const auto [known, is_new] = replaced_.try_emplace(number, 0);
    if (is_new) known->second = take_free();
    return known->second;
  }
  /// Takes the first free number.
  int take_free() {
    int number = 1;
    while (taken_.contains(number)) ++number;
    taken_.insert(number);
    return number;
  }

 private:
  std::set<int> taken_;
  std::map<int, int> replaced_;
};

}  // namespace subvol::internal
