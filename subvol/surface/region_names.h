// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface/region_surface.h"

namespace subvol::internal {

/// Gives regions the names of groups of triangles: a group that bounds a region with all its triangles, and is half or
/// more of the region's boundary by area. A group names one region only, and regions with a name keep it.
///
/// surface  its regions are numbered 1, 2, ... in order, as its sides name them.
void name_regions_by_groups(RegionSurface& surface);

}  // namespace subvol::internal
