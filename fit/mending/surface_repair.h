// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/target/surface_diagnosis.h"
#include "subvol/surface/region_surface.h"
#include "subvol/surface/solid_topology.h"
#include "subvol/surface/triangle_mesh.h"

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace subvol {

/// A surface made ready to be filled, and what was done to it.
struct SurfaceRepair {
  TriangleMesh surface;
  std::optional<RegionSurface> regions;  ///< of the surface, if there are several
  std::vector<std::string> done;         ///< a sentence for each repair; empty: the surface is as it was given
  std::vector<std::string> notes;        ///< a sentence for each fault that was left: contacts, pinholes, crossings
  bool is_fillable = false;  ///< no fault that `prevents_filling` is left but pinholes, which filling closes
};

/// Unites the parts of a surface that cross or overlap, turns parts whose orientation disagrees with their nesting,
/// removes small faults and fins, covers holes, and wraps what bounds no solid all the same.
///
/// The second sides of a two-sided surface are dropped (`without_second_sides`), unless RegionRule::keep is given.
///
/// First, repeated triangles are dropped, triangles that disagree with their part are turned, and triangles are cut
/// where vertices of others lie on their open edges (`tidy_surface`).
///
/// Faces that touch but are cut into other triangles are cut along each other's edges (`imprinted_contacts`) if they
/// are those of named solids (`touching_solids`), if sheets divide the inside, or if RegionRule::keep is given: the
/// solids that touch there become regions. The triangles where named solids touch are there for each of them.
///
/// Other closed parts that cross or share stretches of faces are united (`united`); if one of them is the wall of a
/// void, its inside is taken out of the others (`without`). A wall of a void that points outward is turned, and so is a
/// part that points inward beside others that do not. A solid part in a void stays a part of its own.
///
/// Crossings, contacts of faces, repeated triangles and edges of three triangles that remain are mended if that is
/// possible within `kMendingShare` of the diagonal (`mend_surface`) and leaves fewer places that prevent filling.
///
/// If the surface bounds no solid then, three things are tried, in this order:
/// - fins are left out (`without_fins`) if they have at most a quarter of the area and the rest bounds a solid;
/// - holes are covered (`cover_holes`) if the covers have at most half of the surface's area and it bounds a solid with
///   them; covers are in no group. If crossings are left, and the surface is not wrapped either, it is still covered;
/// - the surface is wrapped (`wrapped_to_fill`) if it has edges of three triangles, or parts that cross and cannot be
///   united, unless RegionRule::keep is given.
///
/// Where there are several regions by the rule (`find_regions`) and nothing crosses, there is nothing to repair. With
/// RegionRule::merge, sheets inside a solid are left out.
///
/// surface    in any state; a surface that needs no repair is returned bit by bit.
/// cancelled  asked now and then, from the calling thread; if it returns true, the surface is returned as it was given.
/// InputError: as `diagnose`; sheets that divide the inside into several regions, if something crosses or an edge has
/// only one triangle; parts that cross and can be neither united nor wrapped, with the place; a sheet with a rim, whose
/// cover would have more than half of its area; a surface that even a wrap does not follow. Cost: that of `diagnose`,
/// again after each step that changes something, and that of `wrap_surface` as a last resort.
SurfaceRepair repair_surface(const TriangleMesh& surface, const std::function<bool()>& cancelled = {},
                             RegionRule rule = RegionRule::automatic);

namespace internal {
struct TouchingSolids;
/// Returns what `repair_surface` returns for a surface in which these solids were found.
SurfaceRepair repair_of_solids(TouchingSolids solids);
}  // namespace internal

/// Returns why grids with up to `kMostTemplateGrowth` times a number of cells do not have the topology of a surface's
/// solid: that they do not, and each cause that the diagnosis of the surface holds, with its place.
std::string why_no_grid(const SurfaceDiagnosis& diagnosis, std::size_t cells, const BettiNumbers& wanted);

/// Returns true if a wall or gap is thinner than this share of the smallest cells that are tried if so many are wanted:
/// if grids do not have the topology, that is why, and somewhat smaller cells do not help.
inline constexpr double kHopelessShare = 0.05;
bool is_too_thin_for_grids(const SurfaceDiagnosis& diagnosis, std::size_t cells);

}  // namespace subvol
