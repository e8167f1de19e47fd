// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <omp.h>

namespace subvol::test {

/// Restores OpenMP's number of threads at the end of a scope, also if a test fails in it.
class ThreadGuard {
 public:
  ThreadGuard() = default;
  ~ThreadGuard() { omp_set_num_threads(before_); }
  ThreadGuard(const ThreadGuard&) = delete;
  ThreadGuard& operator=(const ThreadGuard&) = delete;

  /// Sets the number of threads from here on.
  void use(int threads) { omp_set_num_threads(threads); }

 private:
  int before_ = omp_get_max_threads();
};

}  // namespace subvol::test
