// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/stages/memory_budget.h"

#include "subvol/base/format.h"
#include "subvol/base/process_memory.h"

#include <algorithm>

namespace subvol::internal {

bool MemoryBudget::allows(std::size_t size) {
  if (limit_ <= 0) return true;
  const double held = static_cast<double>(held_memory_bytes());
  if (size_ > 0) {
    const double taken = static_cast<double>(peak_memory_bytes()) - held_ - kMemoryOfAnyPart;
    rate_ = std::max(rate_, taken / size_);
  }
  held_ = held;
  size_ = static_cast<double>(size);
  expected_ = held + kMemoryOfAnyPart + rate_ * size_;
  return expected_ <= limit_;
}

std::string MemoryBudget::refusal(const std::string& part) const {
  return part + formatted(" would take about %.0f MB of memory, the limit is %.0f MB", expected_ / 1e6, limit_ / 1e6);
}

}  // namespace subvol::internal
