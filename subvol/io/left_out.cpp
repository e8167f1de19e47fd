// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/io/left_out.h"

#include <algorithm>

namespace subvol {

void LeftOut::add(std::string_view what, std::size_t n) {
  if (n == 0) return;
  const auto known = places_.find(what);
  if (known != places_.end()) {
    counts_[known->second].second += n;
    return;
  }
  places_.emplace(what, counts_.size());
  counts_.emplace_back(what, n);
}

std::string LeftOut::text() const {
  constexpr std::size_t kMostKinds = 100;
  std::string text;
  for (std::size_t i = 0; i < std::min(counts_.size(), kMostKinds); ++i)
    text += (i == 0 ? "" : ", ") + std::to_string(counts_[i].second) + " " + counts_[i].first;
  if (counts_.size() > kMostKinds) text += ", " + std::to_string(counts_.size() - kMostKinds) + " other kinds";
  return text;
}

void LeftOut::tell(std::vector<std::string>& warnings) const {
  if (!empty()) warnings.push_back("in the file, but not carried over: " + text());
}

}  // namespace subvol
