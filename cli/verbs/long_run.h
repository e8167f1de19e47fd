// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cli/runs/interrupt.h"
#include "cli/runs/losses.h"
#include "cli/runs/outputs.h"
#include "cli/runs/progress.h"
#include "cli/runs/run_options.h"
#include "subvol/fit/stages/fit_report.h"
#include "subvol/fit/stages/solve_control.h"

#include <CLI/CLI.hpp>

#include <chrono>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace subvol::cli {

/// Common parts of the verbs that run long: outputs checked before the work, warnings printed once, parts timed,
/// progress that Ctrl-C interrupts, the last entries of the report, and the exit status.
class LongRun {
 protected:
  LongRun(const RunOptions& run, const CLI::App& verb) : run_(run), verb_(verb) {}

  /// UsageError if there is nothing to write, and as `checked_outputs`. Sets the number of threads and the memory
  /// limit.
  void check_outputs(const std::vector<Part>& parts);
  /// Does the same, and warns of options that have no effect on the outputs.
  void prepare(const std::vector<Part>& parts);
  /// Prints the warnings that have not been printed yet.
  void tell_warnings();
  void add_warnings(const std::vector<std::string>& warnings);
  /// Adds those of `warn_of_names`, before a result is written.
  void add_warnings_of_names(const Marks& result);

  /// Does one part and records how long it took.
  template <class Run>
  void timed(const char* part, void (Run::*work)()) {
    const Clock::time_point begin = Clock::now();
    (static_cast<Run*>(this)->*work)();
    seconds_[part] = seconds_since(begin);
  }
  /// Calls work(), a solve with this control: it reports progress as the options say and is interrupted by Ctrl-C. As
  /// long as there is no result to save (`precedes_result`), and after the work, a signal ends the program at once.
  template <class Work>
  auto followed(SolveControl& control, const Work& work) const {
    ProgressTeller teller(run_.progress, run_.quiet);
    control.cancelled = interrupted;
    control.progress = [&](const FitProgress& progress) {
      if (!precedes_result(progress.stage)) catch_interrupt();
      teller.tell(progress);
      return !interrupted();
    };
    auto result = work();
    control.progress = nullptr;  // it must not outlive the teller
    teller.finish();
    if (!interrupted()) end_on_interrupt();
    return result;
  }

  /// Calls work(progress) for a part after the solve, which reports progress as the options say and is never
  /// interrupted.
  template <class Work>
  auto watched(const Work& work) const {
    ProgressTeller teller(run_.progress, run_.quiet);
    return work(teller.work());
  }

  /// True if a stage comes before anything that a run that is interrupted would write: the template of an automatic
  /// fit, and what a shell needs before its first valid state.
  static bool precedes_result(std::string_view stage);

  double seconds() const { return seconds_since(start_); }
  /// Adds the last entries of every report, and writes the report if one was requested. parts: seconds of parts of the
  /// work.
  void write_report(Json json, const Json& parts = Json::object()) const;
  /// As the function of the same name; outputs that could not be written are added to the report's warnings.
  void write_each(const std::function<void(const Output&)>& write,
                  const std::function<bool(const Output&)>& which = {});
  void tell_outputs() const;
  /// IoError if an output could not be written. To be called at the end of a run, when everything else has been
  /// reported.
  void require_outputs() const { require_all_written(failures_); }
  /// Returns an ExitStatus.
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
  std::vector<std::string> failures_;  ///< outputs that could not be written
  Json seconds_ = Json::object();
};

}  // namespace subvol::cli
