// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>

namespace subvol {

namespace internal {
class StageLog;
}

/// Progress, reported at each step. `level` is 0 if there are no levels; `fraction` estimates the share of the work
/// that is done, in [0, 1].
struct FitProgress {
  const char* stage;
  int level, iteration;
  double energy, fraction;
};

/// Limits of a solve, and how it is watched and ended: the same for all fits, for optimization and for shells.
struct SolveControl {
  int max_iterations = 0;         ///< steps of each stage, in [0, 1e9]; 0: as the schedule says
  double time_limit_seconds = 0;  ///< in [0, 1e12]; 0: no limit. The best result so far is returned when it is over
  std::function<bool(const FitProgress&)> progress{};  ///< returns false to cancel; may be empty
  /// Also asked within steps, from the calling thread; returns true to cancel; may be empty.
  std::function<bool()> cancelled{};
  /// Supplies the results of earlier minimizations and records new ones; null: no log. Linear shells have none.
  internal::StageLog* log = nullptr;
};

namespace internal {
/// Throws InputError, naming `owner`, if a limit is out of its range.
void check_control(const char* owner, const SolveControl& control);

/// Returns the control of one part of a solve: the same, but progress from 0 to 1 is reported as from begin to end.
SolveControl part_of_work(const SolveControl& control, double begin, double end);
}  // namespace internal

}  // namespace subvol
