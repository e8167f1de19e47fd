// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"
#include "subvol/fit/stages/fit_report.h"
#include "subvol/mesh/fit_state.h"

#include <cstddef>
#include <new>
#include <optional>
#include <utility>
#include <vector>

namespace subvol::internal {

/// State to roll back to if an attempted stage brings no improvement.
struct FitSnapshot {
  std::vector<Vec3> x;
  double lambda;
  std::optional<double> mean_percent;  ///< mean distance, if known
  std::size_t num_stages, num_states;  ///< stages in the report and kept states at that time
};

/// Base of fits that move their degrees of freedom through a sequence of minimizations. Provides roll-back and the
/// removal of self-intersections of the boundary.
class StagedFit {
 public:
  StagedFit(const StagedFit&) = delete;
  StagedFit& operator=(const StagedFit&) = delete;

 protected:
  explicit StagedFit(bool keep_states) : keep_states_(keep_states) {}
  ~StagedFit() = default;

  virtual std::vector<Vec3>& unknowns() = 0;
  virtual FitReport& report() = 0;
  /// Runs the last stage of the schedule with this lambda. Returns false if the fit must end.
  virtual bool run_final_stage(double lambda) = 0;
  /// Returns the number of intersecting triangle pairs of the boundary, or nothing if the fit must end.
  virtual std::optional<std::size_t> intersecting_pairs() = 0;

  FitSnapshot snapshot();
  /// Restores the state and marks the later stages as not kept.
  void go_back(FitSnapshot snapshot);
  /// Returns the result of `work`. If memory runs out in it, rolls back to `before`, which needs no memory, and
  /// rethrows.
  template <class Work>
  auto or_back(FitSnapshot& before, const Work& work) {
    try {
      return work();
    } catch (const std::bad_alloc&) {
      go_back(std::move(before));
      throw;
    }
  }
  /// If states are kept, records the current state under the name of the stage that it came from.
  void keep_state();
  /// Repeats the last stage from `start` with increasing weight on the cells' shape, times `factor` (> 1) each time, up
  /// to most_lambda, while `pairs` (in/out) of triangles intersect: thin walls that meet in a soft fit stay apart in a
  /// stiffer one. A repetition is kept if at most half of the pairs remain. Returns false if the fit must end.
  bool unfold(const FitSnapshot& start, double factor, double most_lambda, std::size_t& pairs);

  std::vector<FitState> states_;  ///< states of the current attempt, numbered like the degrees of freedom
  double lambda_ = 0;             ///< lambda of the last stage
  std::optional<double> mean_;    ///< mean distance of the current state, in percent of the diagonal

 private:
  bool keep_states_;
};

}  // namespace subvol::internal
