// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace subvol {

/// Counts the contents of a file that are not used, by kind and in the order in which the kinds are first met.
class LeftOut {
 public:
  void add(std::string_view what, std::size_t n = 1);
  bool empty() const { return counts_.empty(); }
  /// Returns text such as "6 groups, 24 texture coordinates", with the first hundred kinds.
  std::string text() const;
  /// Appends one warning, unless nothing was left out.
  void tell(std::vector<std::string>& warnings) const;

 private:
  std::vector<std::pair<std::string, std::size_t>> counts_;
  std::map<std::string, std::size_t, std::less<>> places_;  ///< of the kinds in `counts_`
};

}  // namespace subvol
