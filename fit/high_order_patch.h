// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/elements/boundary_samples.h"
#include "subvol/fit/elements/element_space.h"
#include "subvol/fit/energies/closest_point_energy.h"
#include "subvol/fit/energies/volume_term.h"
#include "subvol/fit/solver/fit_problem.h"
#include "subvol/mesh/volume_mesh.h"

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace subvol::internal {

/// Rings of cells around the given ones that move with them.
inline constexpr int kHighOrderRings = 2;

/// A part of a mesh of curved cells around a few of them: everything outside is held fixed. The lists of numbers of the
/// mesh are ascending, except `nodes`.
struct HighOrderPatch {
  std::vector<Index> unknowns;  ///< nodes of the mesh that move
  std::vector<Index> cells;     ///< cells of the mesh with a node that moves
  ElementSpace space;           ///< of these cells, with the mesh's orders
  std::vector<Index> nodes;     ///< for each node of `space`, the node of the mesh

  /// The coefficients of the mesh at the nodes of `space`.
  std::vector<Vec3> coefficients(std::span<const Vec3> of_mesh) const;
};

/// Returns the patch around some cells: the vertices of the cells within some rings of them move, and with them the
/// edges, faces and cells all of whose vertices move.
///
/// mesh, space  of the same cells.  centers  cells, at least one.
/// rings        >= 0: cells that share a vertex with the ones before, so many times.
/// most_cells   if the patch has more cells, nothing is returned.
/// Cost: a pass over the mesh for each ring.
std::optional<HighOrderPatch> high_order_patch(const VolumeMesh& mesh, const ElementSpace& space,
                                               std::span<const Index> centers, int rings, std::size_t most_cells);

/// Returns the mesh of some cells (ascending) with their vertices in the order of the mesh, as the same map.
HighOrderMesh cells_of(const HighOrderMesh& mesh, std::span<const Index> cells);

/// Makes the minimization over the unknowns of a patch.
///
/// volume   energy of `patch.space`, which the problem refers to.
/// samples  of the boundary of the whole mesh.  surface  E_S on them, at least `assign_target` at these coefficients:
///          the part of the target that corresponds to the patch there goes with it.
FitProblem patch_problem(const HighOrderPatch& patch, std::span<const Vec3> coefficients,
                         std::unique_ptr<VolumeTerm> volume, const BoundarySamples& samples,
                         const ClosestPointEnergy& surface, double lambda);

}  // namespace subvol::internal
