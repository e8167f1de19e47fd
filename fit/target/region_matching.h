// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/mesh/volume_mesh.h"
#include "subvol/surface/region_surface.h"
#include "subvol/surface/triangle_mesh.h"

#include <optional>

namespace subvol::internal {

/// Returns the regions of a target, numbered as the regions of a mesh in which they lie.
///
/// The target has the regions that `find_regions` finds, with voids as regions (`RegionRule::keep`) if only then there
/// are as many as in the mesh. Each region of the mesh gets that in which most of its cells' centers are, by winding
/// numbers.
///
/// returns  nothing if the mesh has one region or the target has another number of them; if two regions of the mesh
///          would get the same one of the target; or if other pairs of regions have an interface.
/// InputError: as `find_regions`. Cost: a winding number for each cell and region.
std::optional<RegionSurface> regions_as_in(const TriangleMesh& target, const VolumeMesh& mesh);

}  // namespace subvol::internal
