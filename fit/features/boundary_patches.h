// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/features/crease_paths.h"
#include "subvol/fit/features/signed_features.h"
#include "subvol/mesh/mesh_topology.h"
#include "subvol/mesh/volume_mesh.h"
#include "subvol/surface/triangle_mesh.h"

#include <array>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

namespace subvol::internal {

/// The parts into which paths divide a mesh's boundary.
struct BoundaryPatches {
  std::vector<Index> of_face;  ///< patch of each boundary face, in the order of `MeshTopology::boundary_faces`
  std::size_t count = 0;
};

/// Finds the patches: boundary faces connected across edges that belong to no path. A path that ends inside a patch
/// does not divide it. Patches are numbered by their first faces. InputError: a path along something that is not a
/// boundary edge. Cost: linear but for a sort of the paths' edges.
BoundaryPatches boundary_patches(const MeshTopology& topology, std::span<const CreasePath> paths);

/// Returns the edges of a path, as the topology numbers them. InputError: a vertex out of range, or two in a row that
/// have no boundary edge in common.
std::vector<Index> edges_of_path(const MeshTopology& topology, std::span<const Index> path);

/// Patches of a mesh and regions of the target that belong to each other.
struct PatchGroups {
  std::vector<Index> of_patch, of_region;  ///< group of each patch and region
  std::size_t count = 0;
};

/// Matches patches with regions by votes: four points of each boundary face vote for the region of the closest triangle
/// of the target. A patch and a region belong to one group if the region gets at least 20 % of the patch's votes, or
/// the patch gives more than half of the region's votes. Every group has a patch and a region: a patch without a match
/// goes with the region of most of its votes, and a region without one with the patch of the face nearest to its
/// center.
///
/// positions        of the mesh's vertices, near the target and in its coordinates; one per vertex.
/// target, regions  as in `SignedFeatures::regions`.
/// InputError: sizes that do not agree; a target that `ClosestPoint` rejects. Deterministic and parallel. Cost: four
/// closest points per boundary face.
PatchGroups patch_groups(const MeshTopology& topology, const BoundaryPatches& patches, std::span<const Vec3> positions,
                         const TriangleMesh& target, const SignedFeatures& features);

/// Does the same for any faces of a mesh and any triangles of the target, of which only those with the same key belong
/// to each other: keys are those of the pairs of regions that a sheet lies between. Patches and regions have one key
/// each.
///
/// faces       of the mesh, by `MeshTopology`.  patch_of_face, key_of_face  one entry for each of them.
/// regions     region of each triangle, in [0, num_regions).  keys  of each triangle.  All keys are numbered from 0 on.
PatchGroups sheet_patch_groups(const MeshTopology& topology, std::span<const Index> faces,
                               std::span<const Index> patch_of_face, std::size_t num_patches,
                               std::span<const Index> key_of_face, std::span<const Vec3> positions,
                               const TriangleMesh& target, std::span<const Index> regions, std::size_t num_regions,
                               std::span<const Index> keys);

/// Interior angle of the target at a boundary edge of a mesh, in degrees, at the scale of the mesh.
struct EdgeAngle {
  std::array<Index, 2> ends;  ///< the smaller number first
  double angle;
};

/// Measures how the target bends at the boundary edges of a mesh that belong to no path. For each of the edge's faces,
/// the point halfway from the edge's middle to the face's center has a closest triangle; the angle is that between the
/// two triangles' planes. So a rounding counts if it is narrower than a face.
///
/// positions  of the mesh's vertices, near the target and in its coordinates; one per vertex.
/// returns    one angle in [0, 360] per edge, ascending by their ends. InputError: as `patch_groups`,
/// `boundary_patches`.
std::vector<EdgeAngle> smooth_edge_angles(const MeshTopology& topology, std::span<const CreasePath> paths,
                                          std::span<const Vec3> positions, const TriangleMesh& target);

}  // namespace subvol::internal
