// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <functional>
#include <thread>
#include <utility>

namespace subvol::internal {

/// Ends a search that runs in several threads. One thread, the one that makes this object, asks whether to go on.
class SearchStop {
 public:
  /// goes_on  asked from the thread that makes this object, about 20 times a second; empty: the search goes on.
  explicit SearchStop(std::function<bool()> goes_on) : goes_on_(std::move(goes_on)) {}

  /// Returns true if the search is to end. May be called from any thread, often.
  bool is_stopped() {
    if (stopped_.load(std::memory_order_relaxed)) return true;
    if (!goes_on_ || std::this_thread::get_id() != owner_) return false;
    constexpr auto kCancelCheckInterval = std::chrono::milliseconds(50);
    const auto now = std::chrono::steady_clock::now();
    if (now - asked_ < kCancelCheckInterval) return false;
    asked_ = now;
    if (!goes_on_()) stopped_.store(true, std::memory_order_relaxed);
    return stopped_.load(std::memory_order_relaxed);
  }

  /// Returns true if the search is to end; asks at every 4096th count only, for loops over millions of cells.
  bool is_stopped_at(std::size_t count) {
    constexpr std::size_t kCountsPerCancelCheck = 4096;
    return count % kCountsPerCancelCheck == 0 && is_stopped();
  }

  /// Asks until all work is done: for the thread that asks, once it has no work left itself.
  void wait_for(const std::atomic<int>& left) {
    constexpr auto kNap = std::chrono::milliseconds(2);
    while (goes_on_ && std::this_thread::get_id() == owner_ && left.load() > 0 && !is_stopped())
      std::this_thread::sleep_for(kNap);
  }

 private:
  std::function<bool()> goes_on_;
  std::atomic<bool> stopped_{false};
  std::thread::id owner_ = std::this_thread::get_id();
  std::chrono::steady_clock::time_point asked_ = std::chrono::steady_clock::now();
};

}  // namespace subvol::internal
