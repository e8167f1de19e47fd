// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/stages/solve_control.h"

#include "subvol/base/option_checks.h"

#include <algorithm>

namespace subvol::internal {

void check_control(const char* owner, const SolveControl& control) {
  require_in_range(owner, "max_iterations", control.max_iterations, 0, 1e9);
  require_in_range(owner, "time_limit_seconds", control.time_limit_seconds, 0, 1e12);
}

SolveControl part_of_work(const SolveControl& control, double begin, double end) {
  SolveControl part = control;
  if (control.progress)
    part.progress = [whole = control.progress, begin, end](const FitProgress& progress) {
      FitProgress scaled = progress;
      scaled.fraction = begin + (end - begin) * std::clamp(progress.fraction, 0.0, 1.0);
      return whole(scaled);
    };
  return part;
}

}  // namespace subvol::internal
