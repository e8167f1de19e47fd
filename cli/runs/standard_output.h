// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string_view>

namespace subvol::cli {

/// Makes failures of standard output visible: a reader that has gone becomes a write error instead of ending the
/// program, and if descriptor 0, 1 or 2 is closed, no opened file gets its number. To be called once, before anything
/// is written.
void prepare_standard_output();

/// Writes to standard output at once. Failures are recorded for `finished_standard_output`: the files still to be
/// written matter more.
void print(std::string_view text);

/// Flushes standard output, and reports on stderr if it could not be written to, now or earlier.
///
/// returns  the exit status: `status`, or kFailed instead of kDone if output was lost.
int finished_standard_output(int status);

}  // namespace subvol::cli
