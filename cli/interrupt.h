// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace subvol::cli {

/// Makes the first Ctrl-C set a flag; the second ends the program as usual.
void catch_interrupt();
/// Whether Ctrl-C was pressed.
bool interrupted();

}  // namespace subvol::cli
