// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface/region_surface.h"
#include "subvol/surface/triangle_mesh.h"

#include <functional>
#include <optional>
#include <string>

namespace subvol::internal {

/// Named solids that touch, and the regions that they become.
struct TouchingSolids {
  TriangleMesh surface;   ///< each triangle at a contact is there for each solid; `find_regions` finds the regions
  RegionSurface regions;  ///< one of each name
  /// Returns "2 solids touch: they become the regions bolt and plate; --regions merge makes one of them".
  std::string text() const;
};

/// Finds the solids of an assembly: groups that bound a solid each (`volumes_of_named_solids`), of which some touch
/// along faces. Where they touch, they are cut along each other's edges (`imprinted_contacts`).
///
/// surface    finite, with valid vertex numbers.
/// cancelled  asked now and then, from the calling thread; if it returns true, nothing is returned. Empty: never.
/// returns    nothing if the surface is no such assembly: it has no named solids, none of them touch, or some cross or
///            overlap. Cost: that of `imprinted_contacts` and `self_intersections` if there are named solids.
std::optional<TouchingSolids> touching_solids(const TriangleMesh& surface, const std::function<bool()>& cancelled = {},
                                              RegionRule rule = RegionRule::automatic);

}  // namespace subvol::internal
