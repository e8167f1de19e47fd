// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/stages/stage_log.h"

#include "subvol/base/error.h"

namespace subvol::internal {

const SolvedStage* StageLog::recall(const SolvedStage& begun) {
  if (recalled_ == earlier_) return nullptr;
  const SolvedStage& stage = stages_[recalled_];
  if (stage.name != begun.name || stage.start != begun.start || stage.x.size() != begun.x.size())
    throw InputError(source_ + ": does not continue this run: its minimization " + std::to_string(recalled_ + 1) +
                     " (" + stage.name + ") started from something else; it was made by another build or machine");
  ++recalled_;
  return &stage;
}

void StageLog::add(SolvedStage stage) {
  if (!stages_.empty() && !stages_.back().is_over())
    stages_.back() = std::move(stage);
  else
    stages_.push_back(std::move(stage));
  if (on_add) on_add();
}

}  // namespace subvol::internal
