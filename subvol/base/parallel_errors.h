// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <exception>
#include <mutex>

namespace subvol::internal {

/// Carries an exception out of a parallel region, in which an exception that leaves a thread's work ends the program.
///
///   ParallelErrors errors;
///   #pragma omp parallel for
///   for (..) errors.guard([&] { work(); });
///   errors.rethrow();
///
/// The first exception is kept; work that would start after it is skipped.
class ParallelErrors {
 public:
  template <class Work>
  void guard(const Work& work) noexcept {
    try {
      if (!any()) work();
    } catch (...) {
      const std::lock_guard lock(mutex_);
      if (!error_) error_ = std::current_exception();
    }
  }
  /// To be called after the region: rethrows the exception that was kept, if there is one.
  void rethrow() {
    if (error_) std::rethrow_exception(error_);
  }

 private:
  bool any() {
    const std::lock_guard lock(mutex_);
    return error_ != nullptr;
  }

  std::mutex mutex_;
  std::exception_ptr error_;
};

}  // namespace subvol::internal
