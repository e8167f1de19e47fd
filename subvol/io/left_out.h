// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace subvol {

/// What a file holds and nothing is made of: how many of what, in the order in which it was met.
class LeftOut {
 public:
  void add(std::string_view what, std::size_t n = 1);
  bool empty() const { return counts_.empty(); }
  /// "6 groups, 24 texture coordinates".
  std::string text() const;
  /// Appends one warning, unless there is nothing to tell.
  void tell(std::vector<std::string>& warnings) const;

 private:
  std::vector<std::pair<std::string, std::size_t>> counts_;
};

}  // namespace subvol
