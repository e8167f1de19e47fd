// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/stages/fit_options.h"
#include "subvol/mesh/volume_mesh.h"
#include "subvol/subdivision/limit_surface.h"
#include "subvol/subdivision/sparse_map.h"
#include "subvol/surface/triangle_mesh.h"

#include <array>
#include <cstddef>
#include <span>
#include <vector>

namespace subvol::internal {

/// One level of the recursive fit (paper: section 4.3): a finite element mesh over the vertices of a control mesh.
///
///   nodes y = M x,   samples z = N x,   M = P S
///
/// S refines (`subdivide`), P moves boundary vertices to their limit positions (`limit_map`; the identity for
/// FittedSurface::mesh). N refines the boundary further, to as many points of the limit surface as the detail of the
/// target requires. On the finest level the mesh itself is a result too, so N lies between the limit surface and the
/// bilinear quads of the mesh, which shares the gap between the two. If that gap is too wide for the mesh to follow the
/// target and no tolerance is given, N lies on the limit surface alone. For FittedSurface::mesh, the samples are the
/// boundary vertices of the mesh.
struct FitLevel {
  VolumeMesh mesh;       ///< the finite element mesh: hexes
  SparseMap refine;      ///< S alone: maps control vertices to the vertices of the next control mesh
  SparseMap nodes;       ///< M
  SparseMap safe_nodes;  ///< linear split of the previous level's nodes: valid if that mesh is certified
  SparseMap samples;     ///< N
  std::vector<std::array<Index, 3>> sample_triangles;
  std::vector<Index> sample_faces;  ///< face of the mesh of each of these triangles, as MeshTopology numbers it
  /// Interfaces between regions are sampled like the boundary. Group of each face of the mesh (`groups_of_sheets`) and
  /// of each sample triangle, and the faces of interfaces; empty without interfaces.
  std::vector<Index> face_groups, sample_groups, interfaces;
  /// Edges between samples along the creases of the mesh, in the order of its tags, with the same number for each
  /// crease.
  std::vector<std::array<Index, 2>> crease_edges;
  std::vector<Index> parent_creases;  ///< for each crease of the mesh, its parent's position in control.tags.creases
};

/// Builds the level above a control mesh.
///
/// control            the last refined mesh with its tags. `from_unknowns` maps the degrees of freedom to its vertices
///                    (the identity except in cage-only fits), and `previous_nodes` maps them to the nodes of its
///                    finite element mesh.
/// min_samples        wanted number of boundary samples. At most three refinements are made to reach it on the
///                    finest level and one below, and exactly one if the samples lie between the limit surface and the
///                    mesh.
/// finest             true for the last level.
FitLevel make_fit_level(const VolumeMesh& control, const SparseMap& from_unknowns, const SparseMap& previous_nodes,
                        const FitOptions& options, std::size_t min_samples, bool finest);

/// Returns the limit surface of a level, as a tessellation whose chord error is far below that of its mesh.
///
/// limit    refinement of `level.mesh` by `refine_sheets`.
/// control  positions of the vertices of the control mesh.
TriangleMesh limit_triangles(const FitLevel& level, const BoundaryRefinement& limit, std::span<const Vec3> control);

/// Returns the number of refinements beyond a level's mesh by which its limit surface is measured: two, by which the
/// chord error is a sixteenth of the mesh's, or one if the mesh is so fine that two would give more triangles than the
/// distances can be sensitive to.
int limit_refinements(const VolumeMesh& mesh);

}  // namespace subvol::internal
