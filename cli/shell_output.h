// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cli/outputs.h"
#include "cli/writing.h"
#include "shell/shell.h"

#include <string>

namespace subvol::cli {

/// Writes a shell: its cells with thickness at the vertices where the format has fields, its sheets as named nodes of a
/// scene, or its boundary as polygons.
void write_shell(const Output& output, const ShellResult& shell, const WritingOptions& options);

/// Thicknesses of each side that has layers: asked, limited, achieved, clearance, also in per cent of a diagonal.
Json thickness_json(const ShellResult& shell, double diagonal);
/// The same in a line for each side.
std::string thickness_text(const ShellResult& shell);

}  // namespace subvol::cli
