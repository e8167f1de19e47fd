// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/fit_report.h"

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
  /// Leaves the bar's line, before other words are said.
  void finish();

 private:
  void draw_bar(const FitProgress& progress);
  void write_line(const FitProgress& progress);
  void write_json(const FitProgress& progress);

  using Clock = std::chrono::steady_clock;
  Kind kind_;
  Clock::time_point start_, last_;
  std::string last_stage_;
  int last_level_ = -1;
  bool bar_shown_ = false;
};

}  // namespace subvol::cli
