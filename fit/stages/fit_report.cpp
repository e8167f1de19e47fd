// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/stages/fit_report.h"

namespace subvol {

StopReason stop_reason(MinimizerStop stop) {
  switch (stop) {
    case MinimizerStop::converged: return StopReason::converged;
    case MinimizerStop::iteration_limit: return StopReason::iteration_limit;
    case MinimizerStop::cancelled: return StopReason::cancelled;
    case MinimizerStop::no_step:
    case MinimizerStop::infeasible_start: break;
  }
  return StopReason::stalled;
}

const char* to_string(StopReason reason) {
  switch (reason) {
    case StopReason::converged: return "converged";
    case StopReason::tolerance_missed: return "tolerance_missed";
    case StopReason::iteration_limit: return "iteration_limit";
    case StopReason::time_limit: return "time_limit";
    case StopReason::memory_limit: return "memory_limit";
    case StopReason::cancelled: return "cancelled";
    case StopReason::stalled: return "stalled";
  }
  return "unknown";
}

bool ended_early(StopReason reason) {
  return reason == StopReason::time_limit || reason == StopReason::memory_limit || reason == StopReason::cancelled;
}

void FitReport::note_start(const StartComparison& start) {
  initial_distance_mean_percent = 100 * start.mean_distance;
  initial_distance_max_percent = 100 * start.max_distance;
  target = start.target;
  const std::vector<std::string> found = warnings_of(target);
  warnings.insert(warnings.end(), found.begin(), found.end());
}

}  // namespace subvol
