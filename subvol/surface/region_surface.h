// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/mesh/volume_mesh.h"
#include "subvol/surface/triangle_mesh.h"

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace subvol {

/// The number of what lies outside all regions.
inline constexpr int kOutsideRegion = 0;

/// A surface that divides space into regions: each triangle knows the region on either side.
struct RegionSurface {
  TriangleMesh mesh;  ///< vertices of equal position are one; each triangle is there once
  /// The regions behind each triangle and in front of it, where its normal points: {region, kOutsideRegion} on the
  /// outer surface, the smaller number first on an interface.
  std::vector<std::array<int, 2>> sides;
  std::vector<Group> regions;      ///< numbers > 0, ascending, and names where there are any; dimension 3
  std::vector<double> volumes;     ///< of each of `regions`, > 0
  std::vector<std::string> notes;  ///< a sentence for each choice that could have been another

  /// Returns true for triangles between two regions.
  bool is_inner(std::size_t triangle) const { return sides[triangle][1] != kOutsideRegion; }
  /// Returns the pair of regions of each triangle, the smaller number first: kOutsideRegion on the outer surface.
  std::array<int, 2> pair(std::size_t triangle) const {
    return is_inner(triangle) ? sides[triangle] : std::array{kOutsideRegion, sides[triangle][0]};
  }
};

/// What becomes of closed surfaces inside others, and of surfaces inside a solid.
enum class RegionRule {
  /// Sheets that divide a solid make regions. So does a closed part inside another, unless it faces inward, as the
  /// wall of a void does.
  automatic,
  keep,  ///< whatever is enclosed is a region; there are no voids
  merge  ///< there is one region; sheets inside it do not count, and parts inside others are the walls of voids
};
/// Returns the word for a rule in options and reports: "auto", "keep" or "merge".
const char* to_string(RegionRule rule);

/// Finds the regions that a surface divides space into: the connected components of what is left of space, as far as
/// they are enclosed and are no voids.
///
/// Around each edge, the triangles are sorted by angle, so that neighbors there bound the same component. Parts of the
/// surface that no edge connects lie in the smallest component that contains them by winding number.
///
/// With RegionRule::automatic, the inside of a closed part P, which lies in another one, is a void if P faces inward as
/// a whole (more than half of its volume, by signed sum, is negative, seen from the part that all others lie in), and a
/// region otherwise: if it faces outward, if its triangles disagree about the outside, or if each of them is there
/// twice, for the solids on either side.
///
/// Named solids (`volumes_of_named_solids`) that touch along triangles with the same corners, one of each solid, are
/// the regions, if none of them overlaps another: each in one piece or in several. What they enclose together without
/// filling it is then a void, unless RegionRule::keep is given.
///
/// Regions are numbered from 1 on by their first triangles. Other regions get the name of a group of triangles if these
/// all bound it, and are half or more of its boundary by area.
///
/// surface  orientation does not matter but for the rule above.
/// returns  nothing if there are no two regions that share a triangle; if an edge has only one triangle; or if at an
///          edge of more than two, triangles lie on each other up to rounding (`contacts_at_edge`). What encloses no
///          volume up to rounding is no region.
/// InputError: a vertex number out of range, a position that is not finite.
/// Cost: sorts of vertices and edges; of parts inside others, that of winding numbers.
std::optional<RegionSurface> find_regions(const TriangleMesh& surface, RegionRule rule = RegionRule::automatic);

/// Returns the sheets of a mesh of several regions, each quad as four triangles around its center. Regions have their
/// references as numbers, and their names; if a reference is not positive, they are numbered from 1 on instead.
RegionSurface surface_of_regions(const VolumeMesh& mesh);

/// Returns the closed boundary of a region, oriented outward, without groups. It has only the vertices that its
/// triangles name, in the surface's order. It is empty if there is no such region.
TriangleMesh boundary_of_region(const RegionSurface& surface, int region);

/// Returns the same for each of `RegionSurface::regions`. Cost: almost linear.
std::vector<TriangleMesh> boundaries_of_regions(const RegionSurface& surface);

/// Returns the triangles between regions and the outside, oriented outward, with their groups, and without vertices
/// that they do not name.
TriangleMesh outer_surface(const RegionSurface& surface);

/// Returns the triangles between two regions, with the groups and without vertices that they do not name.
/// triangles  receives their numbers in the surface.
TriangleMesh inner_surface(const RegionSurface& surface, std::vector<Index>& triangles);

/// Returns the pairs of regions that share triangles, ascending; those with kOutsideRegion come first.
std::vector<std::array<int, 2>> region_pairs(const RegionSurface& surface);

/// Returns the edges of other than two triangles, and those between different pairs of regions: the curves where sheets
/// meet, as pairs of vertices, ascending.
std::vector<std::array<Index, 2>> curve_edges(const RegionSurface& surface);

/// Sets the volumes from the triangles, and turns these as `sides` says. sides: {a, b} for a region or kOutsideRegion
/// on either side of each triangle, those behind it first; different from each other.
void orient_sheets(RegionSurface& surface);

}  // namespace subvol
