// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/features/crease_distance.h"
#include "fit/solver/minimizer.h"
#include "fit/target/target_report.h"
#include "subvol/base/types.h"

#include <algorithm>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace subvol {

/// Told at every step; level 0: there are none; `fraction` is an estimate of the share done, in [0, 1].
struct FitProgress {
  const char* stage;
  int level, iteration;
  double energy, fraction;
};

/// Why a solve ended. Everything but `input` problems (those throw) is told here, never by an exception.
enum class StopReason {
  converged,  ///< all stages done, each to its stop test or the steps the schedule gives it; tolerance met, if any
  tolerance_missed,  ///< all stages done, but the distance asked for was not reached
  iteration_limit,   ///< the last stage took all the steps that the options allow, and no tolerance tells that it may
  time_limit,
  memory_limit,  ///< the next level, or order, would take more memory than is allowed
  cancelled,     ///< the progress callback said so; the best state so far is returned
  stalled        ///< a level or stage could not be started without inverting a cell
};
const char* to_string(StopReason reason);

/// Why work ended that is done with one minimisation, the last. Without a step, and from no start: stalled.
StopReason stop_reason(MinimizerStop stop);

/// One minimisation with fixed level, lambda and tangential weight.
struct StageRecord {
  std::string name;                ///< "level 2, lambda 0.05", "level 1, continuation t=0.5"
  int level = 0;                   ///< level of the finite element mesh (control level + 1); 0: there are no levels
  int order = 0;                   ///< of curved elements; 0: cells are linear
  double lambda = 0, tangential_weight = 0;
  std::size_t unknowns = 0, cells = 0;
  std::vector<IterationRecord> iterations;
  MinimizerStop ended = MinimizerStop::converged;
  std::string stop;                ///< which test ended it, with its figure
  bool kept = true;                ///< false: undone (the boundary came to intersect itself more, shapes suffered, the
                     ///< fit was interrupted in one that was not asked for), or of a try that was given up
  double seconds = 0;
  double mean_distance_percent = -1;  ///< after the stage, per cent of the diagonal; negative: not measured
};

/// What a fit did, and what is true of its result.
struct FitReport {
  StopReason stop_reason = StopReason::converged;
  std::string explanation;                 ///< one sentence for people
  std::vector<StageRecord> stages;
  double initial_distance_mean_percent = 0, initial_distance_max_percent = 0;
  TargetReport target;                     ///< the state it is in
  std::optional<CreaseDistance> creases;   ///< of the limit surface; where there are sharp edges to follow
  std::vector<std::string> warnings;       ///< audit: what the template's geometry cannot do, topology mismatch, ...
  std::vector<std::pair<std::string, double>> seconds;  ///< by part: "subdivision", "voronoi", "volume", "solve", ...

  /// Notes how far the template is from the target, the state of the target, and what no fit can change about it.
  void note_start(const StartComparison& start);

  /// The last stage whose result was kept; null: none was.
  StageRecord* last_kept_stage() {
    const auto stage = std::find_if(stages.rbegin(), stages.rend(), [](const StageRecord& s) { return s.kept; });
    return stage == stages.rend() ? nullptr : &*stage;
  }

  /// Notes that the results of the stages [begin, end) were not kept.
  void undo_stages(std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) stages[i].kept = false;
  }
};

}  // namespace subvol
