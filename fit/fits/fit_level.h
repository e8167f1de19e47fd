// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/stages/fit_options.h"
#include "subvol/mesh/volume_mesh.h"
#include "subvol/subdivision/sparse_map.h"

#include <array>
#include <cstddef>
#include <vector>

namespace subvol {

/// One level of the recursive fit (paper: section 4.3): a finite element mesh over the vertices of a control mesh.
///
///   nodes y = M x,   samples z = N x,   M = P S
///
/// S refines (`subdivide`), P moves boundary vertices to their limit positions (`limit_map`; the identity for
/// FittedSurface::mesh). N goes further refinements down on the boundary alone, to as many points of the limit surface
/// as the target's detail asks for. On the finest level, where the mesh itself is a result as well, N lies
/// between the limit surface and the mesh's bilinear quads, which shares the gap between the two; but on
/// the limit surface alone where that gap is too wide for the mesh to follow the target, unless a tolerance is asked
/// for.
struct FitLevel {
  VolumeMesh mesh;               ///< the finite element mesh: hexes
  SparseMap refine;              ///< S alone: control vertices to the vertices of the next control mesh
  SparseMap nodes;               ///< M
  SparseMap safe_nodes;          ///< linear split of the previous level's nodes: valid whenever that mesh is certified
  SparseMap samples;             ///< N
  std::vector<std::array<Index, 3>> sample_triangles;
  /// Edges between samples along the mesh's creases, in the order of its tags and equally many for each.
  std::vector<std::array<Index, 2>> crease_edges;
  std::vector<Index> parent_creases;  ///< for each crease of the mesh, the place in control.tags.creases it came from
};

/// Builds the level above a control mesh.
///
/// control            the last refined mesh with its tags; `from_unknowns` takes the unknowns to its vertices (the
///                    identity but for cage-only fits) and `previous_nodes` to the nodes of its finite element mesh.
/// min_samples        how many boundary samples are wanted at least (reached by refining, at most three times).
/// finest             whether this is the last level.
FitLevel make_fit_level(const VolumeMesh& control, const SparseMap& from_unknowns, const SparseMap& previous_nodes,
                        const FitOptions& options, std::size_t min_samples, bool finest);

}  // namespace subvol
