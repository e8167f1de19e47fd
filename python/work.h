// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/stages/fit_report.h"
#include "python/keywords.h"
#include "subvol/base/work_progress.h"

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

/// A step of a long work, as the callback sees it.
struct Progress {
  std::string stage;
  int level, iteration;
  double energy, fraction;
};

/// What one call does without Python's lock: its progress is told, Ctrl-C and errors of the callback end it.
///
/// progress  takes a `Progress`; where it returns False the work ends with the best result so far.
/// threads   number of threads for this call alone; results are the same bits for any.
class Work {
 public:
  /// Takes `progress` and `threads`.
  explicit Work(Keywords& keywords);

  /// Does one part, function(), without the lock, and notes how long it took.
  template <class Function>
  auto run(const char* part, const Function& function) {
    const Clock::time_point begin = Clock::now();
    std::optional<decltype(function())> result;
    try {
      const py::gil_scoped_release unlocked;
      const ThreadCount count(threads_);
      result.emplace(function());
    } catch (...) {
      raise_pending();  // what the library says of work that was ended is no news
      throw;
    }
    raise_pending();
    seconds_.emplace_back(part, std::chrono::duration<double>(Clock::now() - begin).count());
    return std::move(*result);
  }

  /// For the library's options. Called by whatever thread called the library.
  std::function<bool(const FitProgress&)> progress() {
    return [this](const FitProgress& told) { return tell(told); };
  }
  /// Ctrl-C between what is told, within long steps: asks Python ten times a second. From the calling thread alone.
  std::function<bool()> cancelled();
  /// The same for work that tells its parts: stage and fraction, no energy.
  WorkProgress parts() {
    return [this](const char* part, double share) { return tell({part, 0, 0, 0, share}); };
  }
  double seconds() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }
  /// Of a limit in seconds, for what comes next. 0 stays 0: there is none.
  double time_left(double limit) const { return limit > 0 ? std::max(1e-3, limit - seconds()) : limit; }
  const std::vector<std::pair<std::string, double>>& seconds_by_part() const { return seconds_; }

 private:
  using Clock = std::chrono::steady_clock;

  /// OpenMP's number of threads, of the calling thread, while this lives.
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
  int threads_ = 0;  ///< 0: as many as before
  std::optional<py::error_already_set> error_;
  Clock::time_point start_ = Clock::now();
  std::vector<std::pair<std::string, double>> seconds_;
};

/// Tells Python's `warnings` each text. An error where the caller turned warnings into errors.
void warn(const std::vector<std::string>& texts);

}  // namespace subvol::python
