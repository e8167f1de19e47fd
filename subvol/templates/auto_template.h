// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface/solid_topology.h"
#include "subvol/templates/voxel_grid.h"

#include <array>
#include <cstddef>
#include <functional>
#include <vector>

namespace subvol {

/// Options of `auto_templates`.
struct AutoTemplateOptions {
  std::size_t cells = 300;      ///< approximate number, in [kLeastTemplateCells, kMostTemplateCells]
  bool pillow = false;          ///< adds a layer of cells inside the whole boundary; they count toward `cells`
  bool through_planes = false;  ///< grid lines pass through the surface's planes, see `auto_templates`
  /// Called with the estimated progress in [0, 1], which falls back if a larger count must be tried, or other grids
  /// than the one through the planes; returns false to cancel. Empty: none.
  std::function<bool(double fraction)> progress;
};

inline constexpr std::size_t kLeastTemplateCells = 8, kMostTemplateCells = 200'000;
/// If no grid with the requested count has the right topology, larger counts are tried, up to this multiple.
inline constexpr std::size_t kMostTemplateGrowth = 20;
/// The number of cells of a template lies between these multiples of `AutoTemplate::cells_asked`.
inline constexpr double kLeastCellShare = 0.8, kMostCellShare = 1.4;
/// These multiples hold for a template whose grid passes through planes, which leave little choice of sizes.
inline constexpr double kLeastShareThroughPlanes = 0.5, kMostShareThroughPlanes = 2;

/// A template carved from a grid, and its properties.
struct AutoTemplate {
  VolumeMesh mesh;              ///< hexes; passes `validate`
  BettiNumbers topology;        ///< of the mesh, and of the solid that the surface bounds
  std::size_t cells_asked = 0;  ///< the count it was made for: the requested one, or the first larger one that works
  bool pillowed = false;
  Mat3 axes = Mat3::Identity();  ///< columns: directions of the grid's axes
  double score = 0;              ///< dissimilarity to the shape, >= 0; comparable between templates of the same count
  /// For each axis the positions x . axis of the grid lines from the first to the last that the cells touch, length,
  /// increasing; empty if the cells are equal cubes.
  std::array<std::vector<double>, 3> lines;
  VoxelGrid grid;            ///< of which the mesh is a part
  std::vector<char> kept;    ///< for each cell of the grid, non-zero if the mesh without a pillow has it
  double aligned_share = 0;  ///< share of the surface's area on planes through `lines`, in [0, 1]
};

/// The templates that were found, and how many were looked at.
struct AutoTemplateResult {
  std::vector<AutoTemplate> templates;    ///< best first, no two from one grid; empty if cancelled or none was found
  BettiNumbers wanted;                    ///< topology of the surface's solid
  std::size_t grids = 0, candidates = 0;  ///< grids tried; solids found in them with the right topology and count,
                                          ///< possibly several per grid
  bool cancelled = false;
};

/// Makes templates from a surface: carved grids with the topology of its solid, regardless of the surface's details.
///
/// The search tries grids of several orientations (`template_frames`), offsets and sizes. In each, it either takes the
/// cells whose solid fraction exceeds a threshold and repairs them until the boundary is a manifold that can be
/// pillowed, or grows or shrinks a solid cell by cell without changing its topology; missing handles are added and
/// surplus ones removed one by one (`voxel_evolution.h`). Among the results with the right Betti numbers, the ones that
/// cover the solid best are returned.
///
/// With `through_planes`, a grid whose lines pass through the surface's large planes is tried first for each count
/// (`plane_grid.h`). Its cells are boxes, flat ones in thin walls and gaps. Its size is corrected up to four times
/// until the number of cells comes near the count. If one such grid has the right topology and a count within
/// `kLeastShareThroughPlanes` and `kMostShareThroughPlanes`, the result is the best template of these grids, and no
/// other grids are tried. Else, or if less than 3 % of the area would lie on the grid's planes, the result is as
/// without the option.
///
/// surface  any surface that `solid_boundary` accepts. Handles are counted over all components together.
/// most     largest number of templates to return, >= 1.
/// If no grid with the requested count has the right topology, counts 1.3, 1.7, 2.2, 3, ... 20 times as large are
/// tried: `cells_asked` holds the one that worked.
///
/// InputError: as `solid_boundary`; options out of range; a solid whose parts are so far apart, or whose walls are so
/// thin, that every grid would have more than a million plus 64 times the requested number of cells, most of them
/// empty. (Larger counts that would need such grids are not tried. A grid through planes has flat cells in thin walls.)
/// Deterministic and parallel; the result has the same bits for any number of threads. Cost: seconds; it grows with the
/// numbers of cells and triangles.
AutoTemplateResult auto_templates(const TriangleMesh& surface, const AutoTemplateOptions& options = {},
                                  std::size_t most = 1);
/// Does the same for a solid whose boundary is known, which saves time if several templates are made for it.
AutoTemplateResult auto_templates(const SolidBoundary& solid, const AutoTemplateOptions& options = {},
                                  std::size_t most = 1);

}  // namespace subvol
