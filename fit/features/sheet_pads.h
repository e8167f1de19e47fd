// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/features/feature_curves.h"
#include "subvol/fit/features/feature_routing.h"
#include "subvol/fit/features/pads.h"
#include "subvol/mesh/face_groups.h"
#include "subvol/mesh/volume_mesh.h"
#include "subvol/surface/region_surface.h"

#include <cstddef>
#include <map>
#include <optional>
#include <vector>

namespace subvol::internal {

/// A mesh with regions whose sheets, its boundary and the interfaces, are divided into patches by paths along the
/// curves of a target.
struct PatchedSheets {
  VolumeMesh mesh;                    ///< its positions are those that pads are put into; without tags
  std::vector<Vec3> fitted;           ///< positions of the vertices near the target
  std::vector<CreasePath> paths;      ///< ascending by curve
  std::vector<PlacedCorner> corners;  ///< ascending by vertex
  std::map<FaceKey, Index> patches;   ///< of each face of the sheets, whose faces lie between the same two regions
  std::size_t num_patches = 0;
};

/// Pads the sheets of a mesh where angles do not suit the number of cells there (`add_pads`).
///
/// First come pads inside the boundary, through all regions, then pads inside the interfaces of each region. Where a
/// wavy interface meets the flat side of a box, the pads on both sides of it end at that side, and no two cells share
/// the angle there. A pad can end at an interface only if it goes on in the region beyond: the pad around a bolt
/// through two plates goes through both plates. So a pad that a region cannot have alone is made in a body of this
/// region and as many neighbors as it needs. If there is no such body, it covers the interface at which it would end.
///
/// A region that touches the boundary along a curve without having a face there would be cut off by a pad through all
/// regions. Patches along such a curve are padded region by region.
///
/// target, curves  in the coordinates of `fitted`; the curves run along edges of the target.
/// returns  the number of pads. Nothing, and the mesh is unchanged, if a path belongs to a region in part, or if sets
/// of
///          patches want pads that they cannot have.
/// InputError: as `add_pads`. Cost: that of `add_pads` for each region and each pad through neighbors.
std::optional<std::size_t> pad_sheets(PatchedSheets& sheets, const RegionSurface& target, const FeatureCurves& curves);

}  // namespace subvol::internal
