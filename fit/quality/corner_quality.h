// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/mesh/volume_mesh.h"

#include <vector>

namespace subvol {

/// Scaled Jacobians at the corners of cells, as Verdict and the programs that use it compute them.
struct CornerQuality {
  double min_scaled_jacobian = 1;   ///< of all corners; 1 without cells
  double mean_scaled_jacobian = 1;  ///< mean of `cell_minima`; 1 without cells
  std::vector<double> cell_minima;  ///< the least of each cell's corners
};

/// Measures the scaled Jacobian at every corner of a mesh's cells:
///
///   f det(a, b, c) / (|a| |b| |c|),   f = 1 for hexes, 2 / sqrt(3) for prisms, sqrt(2) for tets and pyramids
///
/// with the three edges a, b, c at the corner: 1 for a cube, an equilateral prism, a regular tetrahedron and a pyramid
/// of eight equal edges, whose apex does not count. It differs
/// from that of `measure_quality` in the lengths that it is divided by, except in hexes.
///
/// returns  values in [-1, 1] for each cell, 0 if an edge has no length, -1 if a coordinate is not finite. The mesh
/// must have valid vertex numbers. Parallel; same bits for any number of threads.
CornerQuality measure_corner_quality(const VolumeMesh& mesh);

}  // namespace subvol
