// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface/triangle_mesh.h"

namespace subvol {

class ClosestPoint;

/// Angles between the normals of a fitted surface and those of its target, in [0, 90] degrees. A surface of flat facets
/// and one with waves may be as near as a smooth one; their normals are not.
struct NormalDeviation {
  double mean_degrees = 0;           ///< weighted by area
  double percentile_95_degrees = 0;  ///< 95 % of the area deviates by less; a multiple of half a degree
};

/// Compares normals at points of `fitted` with those at the closest points of `target`, whatever sides the triangles
/// face. Each triangle is cut into m^2 equal ones, m = sqrt(num_samples * its share of the area) rounded, at least 1;
/// their centroids are the points. At sharp edges, the closest point may be on the other side: a fit that is otherwise
/// exact has a deviation there.
///
/// fitted_tree, target_tree  of the surfaces.  num_samples  approximate number of points, >= 1.
/// InputError: as `ClosestPoint` for either surface. Triangles without area do not count; if all are so: zeros.
/// Parallel; same bits for any number of threads.
NormalDeviation normal_deviation(const TriangleMesh& fitted, const ClosestPoint& fitted_tree,
                                 const TriangleMesh& target, const ClosestPoint& target_tree, int num_samples);

}  // namespace subvol
