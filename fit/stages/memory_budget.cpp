// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/stages/memory_budget.h"

#include "subvol/base/format.h"
#include "subvol/base/process_memory.h"

#include <algorithm>

namespace subvol::internal {

bool MemoryBudget::allows(std::size_t size) {
  if (limit_ <= 0) return true;
  const double held = static_cast<double>(held_memory_bytes()), peak = static_cast<double>(peak_memory_bytes());
  if (size_ > 0 && peak > peak_) {  // else the last part has taken no more than what came before
    const double taken = peak - held_;
    const bool is_small = rate_ * size_ < kMemoryOfAnyPart;
    if (is_first_ && is_small)
      fixed_ = std::max(fixed_, taken - rate_ * size_);
    else
      rate_ = std::max(rate_, (taken - fixed_) / size_);
  }
  is_first_ = size_ == 0;
  held_ = held;
  peak_ = peak;
  size_ = static_cast<double>(size);
  expected_ = held + fixed_ + rate_ * size_;
  return expected_ <= limit_;
}

std::string MemoryBudget::refusal(const std::string& part) const {
  return part + formatted(" would take about %.0f MB of memory, the limit is %.0f MB", expected_ / 1e6, limit_ / 1e6);
}

}  // namespace subvol::internal
