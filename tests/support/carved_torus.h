// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "samples/shapes.h"
#include "subvol/templates/carve.h"
#include "subvol/templates/voxel_grid.h"

#include <cstddef>
#include <utility>
#include <vector>

namespace subvol::test {

/// The sample of a torus with a template of cubes that lie in it: many smooth edges of its boundary have one cell.
inline samples::Sample carved_torus_sample() {
  samples::Sample torus = samples::torus_sample();
  const VolumeMesh grid = voxel_mesh(box_grid({-1.6, -1.6, -0.48}, {1.6, 1.6, 0.48}, {8, 8, 2}));
  const std::vector<char> inside = cells_inside(grid, torus.target);
  torus.template_mesh = carve(grid, [&](std::size_t c) { return inside[c] != 0; });
  return torus;
}

}  // namespace subvol::test
