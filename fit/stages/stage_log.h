// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/solver/minimizer.h"

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace subvol::internal {

/// Result of one minimization, or its state so far.
struct SolvedStage {
  std::string name;
  std::uint64_t start = 0;  ///< fingerprint of the start x, the weight lambda, the stop tests and the problem's size
  std::vector<Vec3> x;      ///< final or current state
  MinimizerResult result;   ///< `cancelled`: not finished, continues from x
  double seconds = 0;

  bool is_over() const { return result.stop != MinimizerStop::cancelled; }
};

/// The minimizations of a fit, in the order in which they ran.
///
/// A fit is a function of its input, its options and the results of its minimizations, which take most of its time. So
/// only those results are kept of an interrupted fit. When the fit runs again with them, it takes the same path: it
/// reads each result from the log instead of minimizing, and continues at the end of the log. The outcome is the same
/// bit for bit as without the interruption. Abandoned attempts, continuation and rolled-back stages need no special
/// treatment.
class StageLog {
 public:
  StageLog() = default;
  /// done    stages of an earlier run.
  /// source  origin of these stages for messages, for example a file name.
  StageLog(std::vector<SolvedStage> done, std::string source)
      : stages_(std::move(done)), source_(std::move(source)), earlier_(stages_.size()) {}

  /// Returns the next stage of the earlier run, or null if all have been taken; the stage must then be solved. The last
  /// recorded stage may be unfinished.
  /// InputError: the recorded stage has another start. The input, the options, the program or the machine differs.
  ///
  /// begun  the stage to be solved: its name, fingerprint and start x.
  const SolvedStage* recall(const SolvedStage& begun);
  /// Records a solved stage or the state of an unfinished one. This replaces an earlier record of the same unfinished
  /// stage.
  void add(SolvedStage stage);

  const std::vector<SolvedStage>& stages() const { return stages_; }
  /// Returns the number of stages that have been taken from the earlier run.
  std::size_t num_recalled() const { return recalled_; }

  std::function<void()> on_add;  ///< called after each `add`; may be empty

 private:
  std::vector<SolvedStage> stages_;
  std::string source_;
  std::size_t earlier_ = 0, recalled_ = 0;
};

}  // namespace subvol::internal
