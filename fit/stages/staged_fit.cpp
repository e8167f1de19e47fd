// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/stages/staged_fit.h"

#include <algorithm>
#include <utility>

namespace subvol::internal {

FitSnapshot StagedFit::snapshot() { return {unknowns(), lambda_, mean_, report().stages.size(), states_.size()}; }

void StagedFit::go_back(FitSnapshot snapshot) {
  unknowns() = std::move(snapshot.x);
  lambda_ = snapshot.lambda;
  mean_ = snapshot.mean_percent;
  states_.resize(snapshot.num_states);
  report().undo_stages(snapshot.num_stages, report().stages.size());
  StageRecord* last = report().last_kept_stage();
  if (last && mean_) last->mean_distance_percent = *mean_;  // that of a state after it may have been noted there
}

void StagedFit::keep_state() {
  if (keep_states_) states_.push_back({states_.empty() ? "template" : report().last_kept_stage()->name, unknowns()});
}

bool StagedFit::unfold(const FitSnapshot& start, double factor, double most_lambda, std::size_t& pairs) {
  for (double lambda = factor * lambda_; pairs > 0 && lambda <= most_lambda; lambda *= factor) {
    FitSnapshot softer = snapshot();
    const std::optional<std::size_t> pairs_now = or_back(softer, [&] {
      unknowns() = start.x;
      return run_final_stage(lambda) ? intersecting_pairs() : std::nullopt;
    });
    if (pairs_now && *pairs_now <= pairs / 2) {
      pairs = *pairs_now;
      report().undo_stages(start.num_stages, softer.num_stages);
      // Keep the states up to the start of this repetition.
      states_.resize(std::min(states_.size(), start.num_states + 1));
    } else {
      go_back(std::move(softer));
    }
    if (!pairs_now) return false;
  }
  return true;
}

}  // namespace subvol::internal
