// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface/triangle_mesh.h"

#include <functional>

namespace subvol {

/// Limits of `WrapOptions::voxel_percent`.
inline constexpr double kLeastWrapPercent = 0.1, kMostWrapPercent = 10;

/// Options of `wrap_surface`.
struct WrapOptions {
  /// Edge of the voxels that the inside is made of, in percent of the diagonal, within the limits above. What is
  /// thinner or narrower than two of them may be lost or closed.
  double voxel_percent = 0.5;
};

/// Returns a closed surface that follows one which bounds no solid: with holes, parts that cross, edges of more than
/// two triangles.
///
/// A voxel is inside if the winding number at its center is at least 1/2 (`WindingNumber`); so parts that cross are
/// united, and a hole is closed by a smooth cover over its rim. The boundary of these voxels, smoothed
/// (`surface_of_labels`), is drawn to the closest points of the surface where that is within one and a half voxels and
/// faces the same way, unless a triangle would fold over. Sharp edges are cut off by up to a voxel.
///
/// surface    its triangles must face outward for the most part; its groups arrive on the triangles that lie on them.
/// cancelled  asked now and then, from the calling thread; if it returns true, the result is empty. Empty: never.
/// returns    closed and outward, without triangles if cancelled.
/// InputError: no triangles, a vertex number out of range, a position that is not finite; all triangles at one
/// point; options out of range; no voxel is inside.
/// Same bits for any number of threads. Cost: about two seconds, and a few megabytes, for a million voxels.
TriangleMesh wrap_surface(const TriangleMesh& surface, const WrapOptions& options = {},
                          const std::function<bool()>& cancelled = {});

}  // namespace subvol
