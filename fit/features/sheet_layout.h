// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/features/feature_routing.h"
#include "subvol/fit/features/followed_creases.h"
#include "subvol/fit/features/signed_features.h"
#include "subvol/mesh/volume_mesh.h"
#include "subvol/surface/region_surface.h"

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace subvol::internal {

/// Curves of a target with regions that a mesh is to follow.
struct SheetCurves {
  SignedFeatures features;                   ///< curves, and the parts of the sheets between them; angles say nothing
  std::vector<std::uint8_t> are_junctions;   ///< by curve: 1 where sheets meet, 0 for sharp edges within a sheet
};

/// Finds the curves along which sheets meet and, with an angle, edges that are sharper.
SheetCurves sheet_curves(const RegionSurface& target, std::optional<double> angle_degrees);

/// A mesh with regions prepared to follow the curves of a target.
struct SheetLayout {
  FeatureRouting routing;
  VolumeMesh tagged_mesh;               ///< the mesh with tags on the edges of the paths
  FollowedCreases creases;              ///< of that mesh
  std::vector<CreaseSegment> segments;  ///< edges of the paths, and the curves they follow
  std::vector<Index> patch_of_face;  ///< of each face, by `MeshTopology`: faces of sheets between curves; else kNoIndex
  std::size_t num_patches = 0;
  std::vector<Index> group_of_patch, group_of_triangle;  ///< what belongs to each other (`ClosestPointEnergy`)
};

/// Routes the curves (`route_features`) and divides the sheets of the mesh along them. Parts of sheets correspond only
/// to parts of the target between the same two regions.
///
/// mesh     hexes with references, near the target and in its coordinates; its interfaces lie between the same pairs of
///          regions. Its tags are dropped.
/// InputError: as `route_features`; a pair of regions that the target lacks.
SheetLayout sheet_layout(const VolumeMesh& mesh, const RegionSurface& target, const SheetCurves& curves,
                         const RoutingOptions& options);

/// Returns the group of each face of a mesh that has the sheets of a layout's mesh, on the same vertices; 0 for faces
/// inside regions.
std::vector<Index> groups_of_faces(const SheetLayout& layout, const VolumeMesh& mesh);

}  // namespace subvol::internal
