// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/templates/search_stop.h"
#include "subvol/templates/voxel_topology.h"

#include <span>

namespace subvol::internal {

/// Measures the dissimilarity of a voxel solid and a shape, in [0, inf): 0 if every filled cell is full and every other
/// cell is empty.
///
///   sum |f - s| / sum f  +  sum f cover / sum f  +  0.15 max cover  +  0.15 max(0, max stray - 1)
///
/// f: share of a cell in the shape; s: 1 for filled cells, else 0; cover: steps from a cell to the nearest filled one,
/// its maximum taken over cells with f > 0.02; stray: steps from a filled cell to the nearest one with f > 0.3. The
/// volume alone would accept a template that lacks a finger or spans a hole with a sheet of cells.
/// fractions  f, one per cell, in [0, 1], not all 0. Cost: linear.
/// stop       if given and stopped, the work ends early; the result then means nothing.
/// volumes    weights of the cells in the sums, one per cell, > 0, in any unit (`cell_volumes`); empty: all 1.
double voxel_score(const VoxelSolid& solid, std::span<const double> fractions, std::span<const double> volumes = {},
                   SearchStop* stop = nullptr);

}  // namespace subvol::internal
