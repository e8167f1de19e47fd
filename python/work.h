// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "python/keywords.h"
#include "subvol/base/work_progress.h"
#include "subvol/fit/stages/solve_control.h"

#include <pybind11/pybind11.h>

#include <algorithm>
#include <chrono>
#include <functional>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace subvol::python {

/// A step of long work, as the callback sees it.
struct Progress {
  std::string stage;
  int level, iteration;
  double energy, fraction;
};

/// Runs the parts of one call without Python's lock, and reports their progress; Ctrl-C and errors of the callback end
/// the work.
///
/// progress  is called with a `Progress`; if it returns False, the work ends with the best result so far.
/// threads   number of threads for this call alone; results are the same bits for any.
class Work {
 public:
  /// Takes `progress` and `threads`.
  explicit Work(Keywords& keywords);

  /// Does one part, function(), without the lock, and records how long it took.
  template <class Function>
  auto run(const char* part, const Function& function) {
    const Clock::time_point begin = Clock::now();
    std::optional<decltype(function())> result;
    try {
      const py::gil_scoped_release unlocked;
      const ThreadCount count(threads_);
      result.emplace(function());
    } catch (...) {
      raise_pending();  // the library's error about the ended work would only hide the cause
      throw;
    }
    raise_pending();
    seconds_.emplace_back(part, std::chrono::duration<double>(Clock::now() - begin).count());
    return std::move(*result);
  }

  /// Callback for the library's options. It is called by the thread that called the library.
  std::function<bool(const FitProgress&)> progress() {
    return [this](const FitProgress& told) { return tell(told); };
  }
  /// Sets the callbacks of a solve.
  void watch(SolveControl& control) {
    control.progress = progress();
    control.cancelled = cancelled();
  }
  /// Checks for Ctrl-C between progress reports, within long steps; asks Python at most ten times a second. To be
  /// called only from the calling thread.
  std::function<bool()> cancelled();
  /// Callback for work that reports its parts: stage and fraction, no energy.
  WorkProgress parts() {
    return [this](const char* part, double share) { return tell({part, 0, 0, 0, share}); };
  }
  double seconds() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }
  /// Time left of a limit in seconds, for the next part; at least 1 ms. 0 stays 0: there is no limit.
  double time_left(double limit) const { return limit > 0 ? std::max(1e-3, limit - seconds()) : limit; }
  const std::vector<std::pair<std::string, double>>& seconds_by_part() const { return seconds_; }

 private:
  using Clock = std::chrono::steady_clock;

  /// Sets OpenMP's number of threads, for the calling thread, during its lifetime.
  class ThreadCount {
   public:
    explicit ThreadCount(int threads);
    ~ThreadCount();
    ThreadCount(const ThreadCount&) = delete;
    ThreadCount& operator=(const ThreadCount&) = delete;

   private:
    int before_;
  };

  bool tell(const FitProgress& progress);
  void raise_pending();

  py::object callback_;
  int threads_ = 0;  ///< 0: unchanged
  std::optional<py::error_already_set> error_;
  Clock::time_point start_ = Clock::now();
  std::vector<std::pair<std::string, double>> seconds_;
};

/// Passes each text to Python's `warnings`. Throws if the caller has turned warnings into errors.
void warn(const std::vector<std::string>& texts);

}  // namespace subvol::python
