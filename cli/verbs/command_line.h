// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace subvol::cli {

/// Parses a command line and does what it asks for; returns an ExitStatus.
///
/// argc, argv  as `main` gets them.
/// UsageError: an unknown verb or option, an option without its value, or what a verb refuses. Other errors are those
/// of the verb.
int run_command_line(int argc, char** argv);

}  // namespace subvol::cli
