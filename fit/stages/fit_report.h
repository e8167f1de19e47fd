// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"
#include "subvol/fit/features/crease_distance.h"
#include "subvol/fit/solver/iteration_record.h"
#include "subvol/fit/target/target_report.h"

#include <algorithm>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace subvol {

/// Reason why a solve ended. Invalid input throws instead, and so does memory that runs out before there is a result.
enum class StopReason {
  converged,         ///< all stages ended by their stop tests or step counts; the tolerance, if any, is met
  tolerance_missed,  ///< all stages are done, but the requested distance was not reached, or a result is far off
  iteration_limit,   ///< the last stage used all the steps allowed, and no tolerance was given
  time_limit,
  memory_limit,  ///< the next level or order would exceed the memory limit, or memory ran out
  cancelled,     ///< a callback canceled the run; the best state so far is returned
  stalled        ///< a level or stage could not start or go on without inverting a cell, or invalid cells remain
};
/// Returns the name of a reason as it stands in reports, such as "time_limit".
const char* to_string(StopReason reason);

/// Returns true if a limit of time or memory or the caller ended the work before its end.
bool ended_early(StopReason reason);

/// Returns the stop reason of work that ends with this minimization. No acceptable step and an infeasible start give
/// `stalled`.
StopReason stop_reason(MinimizerStop stop);

/// One minimization with a fixed level, lambda and tangential weight.
struct StageRecord {
  std::string name;  ///< for example "level 2, lambda 0.05, tangential weight 0.003"
  int level = 0;     ///< level of the finite element mesh (control level + 1); 0: there are no levels
  int order = 0;     ///< order of curved elements; 0: cells are linear
  double lambda = 0, tangential_weight = 0;
  std::size_t unknowns = 0, cells = 0;
  std::vector<IterationRecord> iterations;
  MinimizerStop ended = MinimizerStop::converged;
  std::string stop;  ///< the test that ended it, with its value
  /// False if the stage was rolled back (it caused more self-intersections, cost too much of the cells' shape, or was
  /// an optional stage that was interrupted) or belongs to an attempt that was given up.
  bool kept = true;
  bool raises_quality = false;  ///< it minimized the quality energy (`QualityStages`)
  double seconds = 0;
  double mean_distance_percent = -1;  ///< after the stage, percent of the diagonal; negative: not measured
};

/// Record of a fit and the properties of its result.
struct FitReport {
  StopReason stop_reason = StopReason::converged;
  std::string explanation;  ///< one sentence for the user
  std::vector<StageRecord> stages;
  double initial_distance_mean_percent = 0, initial_distance_max_percent = 0;
  TargetReport target;                    ///< state of the target
  std::optional<CreaseDistance> creases;  ///< of the result's surface; empty if there are no edges to follow
  std::vector<std::string> warnings;      ///< findings of the template's audit, a topology mismatch, ...
  std::vector<std::pair<std::string, double>> seconds;  ///< by part: "levels", "solve", "distance" or just "total"

  /// Records the template's initial distance from the target, the target's state, and the warnings that follow from it.
  void note_start(const StartComparison& start);

  /// Returns the last stage whose result was kept, or null if there is none.
  StageRecord* last_kept_stage() {
    const auto stage = std::find_if(stages.rbegin(), stages.rend(), [](const StageRecord& s) { return s.kept; });
    return stage == stages.rend() ? nullptr : &*stage;
  }

  /// Marks the stages [begin, end) as not kept.
  void undo_stages(std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) stages[i].kept = false;
  }
};

}  // namespace subvol
