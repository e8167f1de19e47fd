// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace subvol {

/// How correspondences between the surfaces are chosen in the surface energy.
enum class Correspondence {
  closest,  ///< exact closest points, both ways (`ClosestPointEnergy`): better cells at equal distance (default)
  voronoi   ///< the paper's restricted Voronoi cells (`SurfaceEnergy`)
};

}  // namespace subvol
