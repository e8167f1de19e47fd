// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/stages/solve_control.h"

#include "subvol/base/option_checks.h"

namespace subvol::internal {

void check_control(const char* owner, const SolveControl& control) {
  require_in_range(owner, "max_iterations", control.max_iterations, 0, 1e9);
  require_in_range(owner, "time_limit_seconds", control.time_limit_seconds, 0, 1e12);
}

}  // namespace subvol::internal
