// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/solver/fit_problem.h"
#include "subvol/mesh/volume_mesh.h"

#include <array>
#include <cstddef>
#include <span>
#include <vector>

namespace subvol::internal {

/// A part of a minimization's mesh around a few of its cells: everything outside is held fixed. All lists are
/// ascending.
struct QualityPatch {
  std::vector<Index> unknowns;   ///< degrees of freedom that move
  std::vector<Index> cells;      ///< those with a vertex that moves with them
  std::vector<Index> vertices;   ///< of these cells
  std::vector<Index> triangles;  ///< sample triangles with a sample that moves with them
};

/// Returns the patches around some cells: the degrees of freedom of the cells within some rings of them move. Patches
/// share no cell, so that each can be treated on its own; those that would are one.
///
/// mesh       of the problem's nodes.  triangles  of its samples.
/// centers    cells, ascending.  rings  >= 0: cells that share a vertex with the ones before, so many times.
/// most_cells if the patches have more cells in all, nothing is returned.
/// Cost: one pass over the mesh, and over the maps' entries in the patches.
std::vector<QualityPatch> quality_patches(const VolumeMesh& mesh, const FitProblem& problem,
                                          std::span<const std::array<Index, 3>> triangles,
                                          std::span<const Index> centers, int rings, std::size_t most_cells);

/// Returns the mesh of some cells and their vertices, both in the order of the mesh: no tags, groups or references.
/// cells  ascending.
VolumeMesh patch_mesh(const VolumeMesh& mesh, std::span<const Index> cells);

/// Returns part of a map: the given rows, and the entries in the given columns (ascending), which are renumbered.
SparseMap select(const SparseMap& map, std::span<const Index> rows, std::span<const Index> columns);

}  // namespace subvol::internal
