// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace subvol::cli {

/// Makes a Ctrl-C or SIGTERM end the program at once with status kInterrupted: as long as there is no result that is
/// worth saving, and while results are written. The files that are being written are deleted. May be called again.
void end_on_interrupt();
/// Makes the first Ctrl-C or SIGTERM set a flag. The next one, or one that arrives while the program waits for the
/// reader of a pipe, ends the program at once with status kInterrupted and deletes the files that were being written.
/// Signals within a fifth of a second of the first count as one, because some programs send theirs to a process and to
/// its group. May be called again.
void catch_interrupt();
/// True if one of these signals has arrived.
bool interrupted();

}  // namespace subvol::cli
