// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/stages/fit_report.h"
#include "subvol/base/work_progress.h"

#include <chrono>
#include <string>

namespace subvol::cli {

/// Tells on a terminal, in a log, or to a script how far a long run is.
class ProgressTeller {
 public:
  enum class Kind { bar, plain, json, none };

  /// name: bar, plain, json, none, or empty to choose by what stderr is; quiet: none, but for json.
  ProgressTeller(const std::string& name, bool quiet);
  ~ProgressTeller();
  ProgressTeller(const ProgressTeller&) = delete;
  ProgressTeller& operator=(const ProgressTeller&) = delete;

  void tell(const FitProgress& progress);
  /// Work after the solve: on a bar, in a line once a second has passed, and to scripts as "part" and "share".
  void tell_work(const char* part, double share);
  WorkProgress work() {
    return [this](const char* part, double share) { return tell_work(part, share), true; };
  }
  /// Leaves the bar's line, before other words are said.
  void finish();

 private:
  void draw_bar(double share, const std::string& words);
  void write_line(const FitProgress& progress);
  void write_json(const FitProgress& progress);

  double seconds() const;
  /// Guessed from when the share done last rose; negative where too little is done to tell, or the guess was too low.
  double seconds_left(double share);

  using Clock = std::chrono::steady_clock;
  Kind kind_;
  Clock::time_point start_, last_;
  std::string last_stage_;
  int last_level_ = -1;
  double last_share_ = 0, total_seconds_ = 0;  ///< what the whole was guessed to take when the share was reached
  bool bar_shown_ = false;
};

}  // namespace subvol::cli
