// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/solver/minimizer.h"

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace subvol {

/// What one minimisation came to, or has come to so far.
struct SolvedStage {
  std::string name;
  std::uint64_t start = 0;  ///< fingerprint of the state and the weights it started from
  std::vector<Vec3> x;      ///< where it ended, or is
  MinimizerResult result;   ///< `cancelled`: not over, to go on from x
  double seconds = 0;

  bool is_over() const { return result.stop != MinimizerStop::cancelled; }
};

/// The minimisations of a fit, in the order they ran.
///
/// A fit is a function of its input, its options and the results of its minimisations, and these take most of its time.
/// So their results are all that is kept of a fit that was interrupted: run again with them it goes the same way, takes
/// each result from here where it would minimise, and goes on where the log ends, bit for bit as if it had never
/// stopped. Tries that were given up, continuation and undone stages need nothing of their own.
class StageLog {
 public:
  StageLog() = default;
  /// done    stages of an earlier run.
  /// source  where they are from, for messages: a file name, say.
  StageLog(std::vector<SolvedStage> done, std::string source)
      : stages_(std::move(done)), source_(std::move(source)), earlier_(stages_.size()) {}

  /// The next stage of the earlier run, or null once all have been taken: the stage must then be solved. The last of
  /// them may not be over.
  /// InputError: it did not start from here. The input or the options are others, or the program or machine is another.
  ///
  /// begun  the stage that is to be solved: its name, fingerprint and start x.
  const SolvedStage* recall(const SolvedStage& begun);
  /// Keeps a stage that was solved, or how far it has come: that takes the place of what was kept of it before.
  void add(SolvedStage stage);

  const std::vector<SolvedStage>& stages() const { return stages_; }
  /// How many stages have been taken from the earlier run.
  std::size_t num_recalled() const { return recalled_; }

  std::function<void()> on_add;  ///< called after each `add`; may be empty

 private:
  std::vector<SolvedStage> stages_;
  std::string source_;
  std::size_t earlier_ = 0, recalled_ = 0;
};

}  // namespace subvol
