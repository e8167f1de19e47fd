// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace subvol::cli {

/// Makes the first Ctrl-C, or the first SIGTERM, set a flag; the second ends the program as usual.
void catch_interrupt();
/// Whether one of them has come.
bool interrupted();

}  // namespace subvol::cli
