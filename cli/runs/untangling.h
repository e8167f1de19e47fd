// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cli/runs/run_options.h"
#include "fit/optimize_mesh.h"
#include "subvol/mesh/volume_mesh.h"

#include <string>
#include <vector>

namespace subvol::cli {

/// Whether some cells of a template, but not most of them, are flat or left-handed at a corner: a mesh that can be
/// mended, not one that is numbered the other way round.
bool has_few_inverted_cells(const VolumeMesh& mesh);

/// Makes a template's cells valid over its own boundary, and tells so in a warning. Nothing is done where they all are.
///
/// path     of its file, for messages.
/// options  but for their progress.
/// InputError: some cells cannot be made valid. EndedEarly: Ctrl-C, or the time was over, before they were.
void untangle_template(const std::string& path, const RunOptions& run, OptimizeOptions options, VolumeMesh& mesh,
                       std::vector<std::string>& warnings);

}  // namespace subvol::cli
