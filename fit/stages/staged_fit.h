// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/stages/fit_report.h"
#include "subvol/base/types.h"
#include "subvol/mesh/fit_state.h"

#include <cstddef>
#include <new>
#include <optional>
#include <utility>
#include <vector>

namespace subvol {

/// What a fit goes back to where a stage that it tries is no help.
struct FitSnapshot {
  std::vector<Vec3> x;
  double lambda;
  std::optional<double> mean_percent;  ///< distance, if it is known
  std::size_t num_stages, num_states;  ///< then in the report, and kept
};

/// A fit that leads its unknowns through one minimisation after the other: how it goes back to where it was, and how
/// it unfolds a boundary that has come to intersect itself.
class StagedFit {
 public:
  StagedFit(const StagedFit&) = delete;
  StagedFit& operator=(const StagedFit&) = delete;

 protected:
  explicit StagedFit(bool keep_states) : keep_states_(keep_states) {}
  ~StagedFit() = default;

  virtual std::vector<Vec3>& unknowns() = 0;
  virtual FitReport& report() = 0;
  /// The last stage of all with this lambda. False when the fit must end.
  virtual bool run_final_stage(double lambda) = 0;
  /// Of triangles of the boundary. None when the fit must end.
  virtual std::optional<std::size_t> intersecting_pairs() = 0;

  FitSnapshot snapshot();
  void go_back(FitSnapshot snapshot);
  /// What `work` returns. Where memory runs out in it the fit is back at `before`, for which none is needed.
  template <class Work>
  auto or_back(FitSnapshot& before, const Work& work) {
    try {
      return work();
    } catch (const std::bad_alloc&) {
      go_back(std::move(before));
      throw;
    }
  }
  /// Keeps where the unknowns are, under the name of what they came from; if states are kept.
  void keep_state();
  /// The last stage again from `start`, with more weight on the cells' shape up to most_lambda, while there are `pairs`
  /// that intersect: thin walls that meet in a soft fit stay apart in a stiffer one. Kept where that leaves at most
  /// half of them. False when the fit must end.
  bool unfold(const FitSnapshot& start, double most_lambda, std::size_t& pairs);

  std::vector<FitState> states_;  ///< of the current try, by the numbers of the unknowns
  double lambda_ = 0;             ///< of the last stage
  std::optional<double> mean_;    ///< distance, percent, of the current state

 private:
  bool keep_states_;
};

}  // namespace subvol
