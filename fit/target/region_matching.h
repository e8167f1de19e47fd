// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/mesh/volume_mesh.h"
#include "subvol/surface/region_surface.h"
#include "subvol/surface/triangle_mesh.h"

#include <functional>
#include <optional>
#include <string>

namespace subvol::internal {

/// Returns the regions of a target, numbered as the regions of a mesh in which they lie.
///
/// The target has the regions of `touching_solids`, or those that `find_regions` finds, with voids as regions
/// (`RegionRule::keep`) if only then there are as many as in the mesh. Regions of the mesh and the target belong to
/// each other one to one: those in which the most centers of cells are come first, by winding numbers.
///
/// cancelled  asked now and then, from the calling thread, while touching solids are looked for; if it returns true,
///            none are found. Empty: never.
/// returns    nothing if the mesh has one region or the target has another number of them; if a region of the mesh is
///            in none of the target that is left for it; or if other pairs of regions have an interface.
/// InputError: as `find_regions`. Cost: a winding number for each cell and region.
std::optional<RegionSurface> regions_as_in(const TriangleMesh& target, const VolumeMesh& mesh,
                                           const std::function<bool()>& cancelled = {});

/// Holds what a fit with a template reproduces of a target.
struct MatchedTarget {
  std::optional<RegionSurface> regions;  ///< those of the target, if the template has the same
  /// The boundary reproduces this, the outer surface of the target's regions; nothing: it reproduces all of the target.
  std::optional<TriangleMesh> outer;
  std::string warning;  ///< why sheets inside the target are left out; empty: none are
};

/// Finds what a template can reproduce of a target. If the target has regions, and the template does not have the same
/// ones (`regions_as_in`) and no cavity, that is the target's outer surface: sheets inside would draw the boundary
/// inward. The walls of cavities may look like regions, depending on their orientation; they stay.
/// A template with a vertex number out of range gets nothing.
///
/// cancelled  as for `regions_as_in`; if it returns true, nothing is known, and there is no warning.
/// InputError: as `regions_as_in`. Cost: as `find_regions`, and `regions_as_in` if the template has regions.
MatchedTarget matched_target(const TriangleMesh& target, const VolumeMesh& template_mesh,
                             const std::function<bool()>& cancelled = {});

}  // namespace subvol::internal
