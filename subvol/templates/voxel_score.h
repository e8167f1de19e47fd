// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/templates/voxel_topology.h"

#include <span>

namespace subvol {

/// How unlike a shape a voxel solid is, in [0, inf): 0 where each cell is full and filled, or empty and not.
///
///   sum |f - s| / sum f  +  mean cover  +  0.15 max cover  +  0.15 max(0, max stray - 1)
///
/// f: share of a cell in the shape; s: 1 for filled cells, else 0; cover: steps through cells of the shape (f > 0.02)
/// from a cell to the nearest filled one, weighted by f; stray: steps from a filled cell to one that is mostly in the
/// shape. Volume alone would pass a template that lacks a finger or spans a hole with a sheet of cells. fractions  one
/// per cell, in [0, 1], not all 0. Cost: linear.
double voxel_score(const VoxelSolid& solid, std::span<const double> fractions);

}  // namespace subvol
