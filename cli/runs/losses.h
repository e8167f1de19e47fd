// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cli/runs/outputs.h"
#include "subvol/mesh/volume_mesh.h"

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace subvol::cli {

/// Data of a mesh besides its cells: numbers of cells with a reference, of creases, of corners and of groups of faces.
struct Marks {
  std::size_t references = 0, creases = 0, corners = 0, groups = 0;
};
Marks marks_of(const VolumeMesh& mesh);

/// Adds one warning about marks that were read but are in none of the outputs, because none of the formats holds them
/// or the result no longer has them.
///
/// curved  the outputs hold curved cells, which have no creases and corners.
void warn_of_losses(const Marks& read, const Marks& result, std::span<const Output> outputs,
                    std::vector<std::string>& warnings, bool curved = false);

}  // namespace subvol::cli
