// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cli/runs/run_options.h"
#include "subvol/fit/elements/high_order_mesh.h"
#include "subvol/fit/optimize_mesh.h"
#include "subvol/mesh/volume_mesh.h"

#include <string>
#include <vector>

namespace subvol::cli {

/// True if some cells of a template, but fewer than half of them, are flat or left-handed at a corner: such a mesh can
/// be repaired, unlike one whose cells are all numbered the wrong way round.
bool has_few_inverted_cells(const VolumeMesh& mesh);

/// Makes a template's cells valid over its own boundary, and reports that in a warning. Does nothing if all are valid.
///
/// path     of the template's file, for messages.
/// options  progress and cancelled are replaced.
/// InputError: some cells cannot be made valid. EndedEarly: Ctrl-C or the time limit came first.
void untangle_template(const std::string& path, const RunOptions& run, OptimizeOptions options, VolumeMesh& mesh,
                       std::vector<std::string>& warnings);

/// Does the same for curved cells. labels: the same cells with their references and groups.
void untangle_template(const std::string& path, const RunOptions& run, const OptimizeOptions& options,
                       const VolumeMesh& labels, HighOrderMesh& mesh, std::vector<std::string>& warnings);

}  // namespace subvol::cli
