// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>

namespace subvol {

/// Told by work that may take more than a second what it does next, and an estimate of the share done, in [0, 1].
/// Returns false to end it there, with what there is. May be empty.
using WorkProgress = std::function<bool(const char* part, double fraction)>;

/// Tells it, and whether the work is to go on.
inline bool goes_on(const WorkProgress& progress, const char* part, double fraction) {
  return !progress || progress(part, fraction);
}

}  // namespace subvol
