// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/features/feature_routing.h"
#include "subvol/fit/features/followed_creases.h"
#include "subvol/fit/features/signed_features.h"
#include "subvol/mesh/volume_mesh.h"
#include "subvol/surface/region_surface.h"
#include "subvol/templates/pillow.h"

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace subvol::internal {

/// Curves of a target with regions that a mesh is to follow.
struct SheetCurves {
  SignedFeatures features;                  ///< curves, and the parts of the sheets between them; angles say nothing
  std::vector<std::uint8_t> are_junctions;  ///< by curve: 1 where sheets meet, 0 for sharp edges within a sheet
};

/// Finds the curves along which sheets meet and, with an angle, edges that are sharper.
SheetCurves sheet_curves(const RegionSurface& target, std::optional<double> angle_degrees);

/// A grid with regions prepared to follow the curves of a target: routed, divided into patches and padded.
struct SheetLayout {
  FeatureRouting routing;
  std::optional<std::size_t> pads;      ///< number of pads; nothing: the regions have pillows instead
  VolumeMesh tagged_mesh;               ///< the mesh to fit, from its positions, with tags on the edges of the paths
  FollowedCreases creases;              ///< of that mesh
  std::vector<CreaseSegment> segments;  ///< edges of the paths between its vertices, and the curves they follow
  /// The faces of a group correspond to the triangles of the same group (`ClosestPointEnergy`). There is one entry per
  /// face of the mesh, by `MeshTopology`, 0 for faces inside regions, and one per triangle of the target.
  std::vector<Index> group_of_face, group_of_triangle;
};

/// Routes the curves (`route_features`), divides the sheets of the mesh along them and pads them (`pad_sheets`). If
/// that is not possible, regions are pillowed instead (`pillow_regions`). Parts of sheets correspond only to parts of
/// the target between the same two regions.
///
/// grid     hexes with references; its interfaces lie between the same pairs of regions as those of the target. Its
///          tags are dropped.
/// fitted   positions of its vertices near the target, in its coordinates.
/// pillow   the layers of regions that have no pads.
/// InputError: as `route_features`, `pad_sheets`, `pillow_regions`; a pair of regions that the target lacks.
SheetLayout sheet_layout(const VolumeMesh& grid, std::span<const Vec3> fitted, const RegionSurface& target,
                         const SheetCurves& curves, const RoutingOptions& options, const PillowChoice& pillow);

}  // namespace subvol::internal
