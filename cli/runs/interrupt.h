// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace subvol::cli {

/// Makes the first Ctrl-C, or SIGTERM, set a flag; the next one, or one that comes while a pipe has no reader, ends the
/// program at once, with status kInterrupted, and deletes what it was writing. Those that come within a fifth of a
/// second count as one: some programs send theirs to a process and to its group. May be called again.
void catch_interrupt();
/// Whether one of them has come.
bool interrupted();

}  // namespace subvol::cli
