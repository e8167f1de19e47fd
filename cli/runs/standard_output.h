// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string_view>

namespace subvol::cli {

/// Makes standard output one that can fail: a reader that has gone is an error of writing and not the program's end,
/// and where descriptor 0, 1 or 2 is closed no file that is opened takes its number. Once, before anything is written.
void prepare_standard_output();

/// Writes to standard output at once. What cannot be written is noted for `finished_standard_output`: files that are
/// still to be written matter more.
void print(std::string_view text);

/// Flushes standard output, and tells on stderr if it could not be written to, now or earlier.
///
/// returns  the exit status: `status`, or kFailed in place of kDone where output was lost.
int finished_standard_output(int status);

}  // namespace subvol::cli
