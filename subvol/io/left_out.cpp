// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/io/left_out.h"

#include <algorithm>

namespace subvol {

void LeftOut::add(std::string_view what, std::size_t n) {
  if (n == 0) return;
  const auto is_known = [&](const auto& count) { return count.first == what; };
  const auto known = std::find_if(counts_.begin(), counts_.end(), is_known);
  if (known == counts_.end())
    counts_.emplace_back(std::string(what), n);
  else
    known->second += n;
}

std::string LeftOut::text() const {
  std::string text;
  for (const auto& [what, n] : counts_) text += (text.empty() ? "" : ", ") + std::to_string(n) + " " + what;
  return text;
}

void LeftOut::tell(std::vector<std::string>& warnings) const {
  if (!empty()) warnings.push_back("in the file, but not carried over: " + text());
}

}  // namespace subvol
