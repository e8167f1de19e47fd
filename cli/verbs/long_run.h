// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cli/runs/interrupt.h"
#include "cli/runs/outputs.h"
#include "cli/runs/progress.h"
#include "cli/runs/run_options.h"
#include "fit/stages/fit_report.h"

#include <CLI/CLI.hpp>

#include <chrono>
#include <functional>
#include <string>
#include <vector>

namespace subvol::cli {

/// What the verbs that run long have in common: outputs looked at before the work, warnings told once, parts timed, a
/// progress that Ctrl-C ends, the end of the report, and the exit status.
class LongRun {
 protected:
  LongRun(const RunOptions& run, const CLI::App& verb) : run_(run), verb_(verb) {}

  /// UsageError where there is nothing to write, and as `checked_outputs`. Sets the number of threads.
  void prepare(const std::vector<Part>& parts);
  /// Tells the warnings that have not been told yet.
  void tell_warnings();
  void add_warnings(const std::vector<std::string>& warnings);

  /// Does one part and notes how long it took.
  template <class Run>
  void timed(const char* part, void (Run::*work)()) {
    const Clock::time_point begin = Clock::now();
    (static_cast<Run*>(this)->*work)();
    seconds_[part] = seconds_since(begin);
  }
  /// work(progress), the progress told as the options say and ended by Ctrl-C.
  template <class Work>
  auto followed(const Work& work) const {
    ProgressTeller teller(run_.progress, run_.quiet);
    catch_interrupt();
    auto result = work([&](const FitProgress& progress) {
      teller.tell(progress);
      return !interrupted();
    });
    teller.finish();
    return result;
  }

  /// work(progress) of a part after the solve: told as the options say, never ended.
  template <class Work>
  auto watched(const Work& work) const {
    ProgressTeller teller(run_.progress, run_.quiet);
    return work(teller.work());
  }

  double seconds() const { return seconds_since(start_); }
  /// Adds what every report ends with, and writes it if one was asked for. parts: seconds of parts of the work.
  void write_report(Json json, const Json& parts = Json::object()) const;
  /// As the function of that name, with what could not be written in the report's warnings.
  void write_each(const std::function<void(const Output&)>& write,
                  const std::function<bool(const Output&)>& which = {});
  void tell_outputs() const;
  /// At the end of a run, when all else is told: IoError if an output could not be written.
  void require_outputs() const { require_all_written(failures_); }
  /// An ExitStatus.
  static int status(const FitReport& report, bool valid);

  const RunOptions& run_;
  const CLI::App& verb_;
  std::vector<Output> outputs_;
  std::vector<std::string> warnings_;

 private:
  using Clock = std::chrono::steady_clock;
  static double seconds_since(Clock::time_point begin) {
    return std::chrono::duration<double>(Clock::now() - begin).count();
  }

  Clock::time_point start_ = Clock::now();
  std::size_t told_ = 0;
  std::vector<std::string> failures_;  ///< of outputs
  Json seconds_ = Json::object();
};

}  // namespace subvol::cli
