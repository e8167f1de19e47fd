// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/mesh/volume_mesh.h"
#include "subvol/surface/region_surface.h"

#include <array>
#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

namespace subvol {

/// Options of `region_template`.
struct RegionTemplateOptions {
  std::size_t cells = 300;  ///< approximate number, in [kLeastTemplateCells, kMostTemplateCells]
  /// Layers are to be put on the sheets of the grid: `pillow_regions` can do so, and the cells that it would add count
  /// toward `cells`.
  bool for_pillow = false;
  /// Called with the estimated progress in [0, 1], which falls back if a larger count must be tried; returns false to
  /// cancel. Empty: none.
  std::function<bool(double fraction)> progress;
};

/// A template carved from a grid, each of its cells in one region.
struct RegionTemplate {
  VolumeMesh mesh;               ///< hexes with references and names of regions; not pillowed
  std::size_t cells_asked = 0;   ///< the count it was made for: the requested one, or the first larger one that works
  bool through_planes = false;   ///< grid lines pass through planes of the surface
  double aligned_share = 0;      ///< share of the surface's area, interfaces counted once, on planes through grid lines
  std::size_t wrong_sheets = 0;  ///< interfaces and parts of the boundary whose topology is not that of the surface
};

/// The template, or what kept it from being found.
struct RegionTemplateResult {
  std::optional<RegionTemplate> made;  ///< empty if cancelled or none was found
  std::vector<Index> missed;           ///< places in `RegionSurface::regions` of those that were wrong most often
  bool cancelled = false;
};

/// Makes a template for several regions: a carved grid in which each region has the topology that it has in the
/// surface, and in which the same regions have faces in common.
///
/// Each cell of a grid is given to the region that has most of it; layers thinner than a cell are given more weight
/// until they are whole. Cells are then exchanged one by one until every region's boundary is a manifold, and after
/// that as long as it improves the likeness and keeps the topology (`VoxelLabels::is_simple`). Of the grids whose
/// regions have the right Betti numbers, and whose pairs of neighbors are those of the surface, the one with the fewest
/// interfaces of wrong topology is taken, and of these the one that is most like the surface. Grids pass through large
/// planes of the surface if there are any (`lines_through_planes`).
///
/// If no grid with the requested count works, counts up to 9 times as large are tried.
/// InputError: options out of range; a region whose boundary bounds no solid (`solid_boundary`); regions so far apart,
/// or so thin, that every grid is too large.
/// Deterministic; serial but for the shares of regions.
RegionTemplateResult region_template(const RegionSurface& surface, const RegionTemplateOptions& options = {});

}  // namespace subvol
