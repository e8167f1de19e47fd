// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface/solid_topology.h"
#include "subvol/templates/voxel_grid.h"

#include <cstddef>
#include <functional>
#include <vector>

namespace subvol {

struct AutoTemplateOptions {
  std::size_t cells = 300;  ///< about so many, kLeastTemplateCells .. kMostTemplateCells
  bool pillow = false;      ///< a layer of cells around the whole boundary, counted in
  /// Told the share of grids looked at, in [0, 1]; returns false to cancel. Empty: none.
  std::function<bool(double fraction)> progress;
};

inline constexpr std::size_t kLeastTemplateCells = 8, kMostTemplateCells = 200'000;
/// A template has between these multiples of the number of cells asked for.
inline constexpr double kLeastCellShare = 0.8, kMostCellShare = 1.4;

/// A template made of a grid, and what is known of it.
struct AutoTemplate {
  VolumeMesh mesh;              ///< hexes; passes `validate`
  BettiNumbers topology;        ///< of the mesh, and of the solid that the surface bounds
  std::size_t cells_asked = 0;  ///< the count it was made for: the one asked for, or the next on the ladder that works
  bool pillowed = false;
  Mat3 axes = Mat3::Identity(); ///< columns: directions of the grid
  double score = 0;             ///< how far from the shape, >= 0; comparable between templates of the same count
};

struct AutoTemplateResult {
  std::vector<AutoTemplate> templates;  ///< best first, no two from one grid; empty where cancelled or none was found
  BettiNumbers wanted;                  ///< topology of the surface's solid
  std::size_t grids = 0, candidates = 0;  ///< looked at; of them with the right topology and count
  bool cancelled = false;
};

/// Makes templates from a surface: carved grids with the topology of its solid, whatever the surface's details.
///
/// Grids of several orientations (`template_frames`), offsets and sizes are tried. In each, the cells that lie in the
/// solid by more than some share are repaired until the boundary is a manifold that can be pillowed, or cells are grown
/// and shrunk one by one without a change of topology; handles that are missing or too many are added and removed one
/// by one (`voxel_evolution.h`). Of what has the right Betti numbers, the one that covers the solid best is taken.
///
/// surface  as `solid_boundary` takes it. Handles are counted over all components together.
/// most     how many templates to return, >= 1.
/// Where no grid of the count asked for carries the topology, counts 1.3, 1.7, 2.2, 3, ... 20 times as large are tried:
/// `cells_asked` tells which one worked.
///
/// InputError: as `solid_boundary`; options out of range; a solid whose parts are so far apart, or walls so thin, that
/// grids would have more than a million and 64 times the cells asked for, most of them empty (larger counts for which
/// they would are not tried).
/// Deterministic, parallel, same bits for any number of threads. Cost: seconds; grows with cells and triangles.
AutoTemplateResult auto_templates(const TriangleMesh& surface, const AutoTemplateOptions& options = {},
                                  std::size_t most = 1);

}  // namespace subvol
