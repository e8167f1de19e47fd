// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <functional>

namespace subvol {

/// Callback of work that may take more than a second. It receives the part that comes next and an estimate of the share
/// done, in [0, 1], and returns false to end the work there with the results so far. It may be empty.
using WorkProgress = std::function<bool(const char* part, double fraction)>;

/// Reports progress; returns true if the work must go on.
inline bool goes_on(const WorkProgress& progress, const char* part, double fraction) {
  return !progress || progress(part, fraction);
}

}  // namespace subvol
