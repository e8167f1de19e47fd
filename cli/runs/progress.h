// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/work_progress.h"
#include "subvol/fit/stages/solve_control.h"

#include <chrono>
#include <string>

namespace subvol::cli {

/// Reports the progress of a long run on a terminal, in a log, or to a script.
class ProgressTeller {
 public:
  enum class Kind { bar, plain, json, none };

  /// name: bar, plain, json, none, or empty to choose depending on whether stderr is a terminal; quiet: reports nothing
  /// unless the name is json.
  ProgressTeller(const std::string& name, bool quiet);
  ~ProgressTeller();
  ProgressTeller(const ProgressTeller&) = delete;
  ProgressTeller& operator=(const ProgressTeller&) = delete;

  /// Reports a step of a fit, whose share of the run is nine tenths.
  void tell(const FitProgress& progress);
  /// Reports work after the solve: on the bar, as a line at most once a second, or to scripts as "part" and "share".
  void tell_work(const char* part, double share);
  /// Reports how many of several equal parts are done: on the bar, as a line every ten seconds, or to scripts as "done"
  /// and "total".
  void tell_count(std::size_t done, std::size_t total, const std::string& words);
  WorkProgress work() {
    return [this](const char* part, double share) { return tell_work(part, share), true; };
  }
  /// Ends the bar's line, before other text is printed.
  void finish();

 private:
  void draw_bar(double share, const std::string& words);
  void write_line(const FitProgress& progress);
  void write_json(const FitProgress& progress);

  double seconds() const;
  /// Estimated from the time at which the share last changed; negative if too little is done for an estimate, or if the
  /// estimate was too low.
  double seconds_left(double share);

  using Clock = std::chrono::steady_clock;
  Kind kind_;
  Clock::time_point start_, last_;
  std::string last_stage_;
  int last_level_ = -1;
  bool has_fit_ = false;                       ///< true if work is what follows a fit
  double last_share_ = 0, total_seconds_ = 0;  ///< estimated total time when that share was reached
  bool bar_shown_ = false;
};

}  // namespace subvol::cli
