// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/features/boundary_patches.h"
#include "subvol/fit/features/feature_routing.h"
#include "subvol/fit/features/pads.h"
#include "subvol/fit/features/signed_features.h"
#include "subvol/surface/triangle_mesh.h"

#include <cstddef>
#include <vector>

namespace subvol::internal {

struct NarrowStrips {
  std::size_t num_followed = 0;  ///< number of curves that are followed now
  std::vector<Pad> pads;         ///< those that were made for them, in their order
};

/// Follows curves that run beside a followed one, closer to it than a cell, as those of a chamfer or a small step do.
/// No path of the grid is left for them, but the side of a pad is one:
///
///              A                             A
///        o---o---o N                   o---o---o N      The curve N has a path, which separates the patches A and B.
///        |   |   |                     o---o---o C      A pad under A has a side, a row of faces between N and C. It
///        o---o---o  B        ->        |   |   |        is the strip, and its lower border follows the lost curve C.
///        |   |   |                     o---o---o  B
///        o---o---o                     |   |   |
///
/// If a pad under B suits the angles better, the path of N follows C, and the border of its side follows N. A row that
/// is there already serves as well.
///
/// A curve C is followed like this if
///   - no path follows any part of it, and it is at least h long;
///   - each of the two curves is at most 0.95 h away from the other all along, and both are open or both are closed;
///   - the region between them has at most 1.5 times the area of a strip of their mean length and distance;
///   - it has no corner if it is closed, and no corner in common with N if it is open: such a strip tapers to a point;
///   - no path runs into the row, and the cells at both curves get angles between 40 and 150 degrees.
///
/// At the end of an open strip, the path of a curve that ends at C's corner may run along the end of the row. It is cut
/// back to the border of the row, and a curve between the corners of N and C that is shorter than a cell follows the
/// end.
///
/// patched   from `patched_mesh` and `add_pads`. Its positions may gain vertices, as by `pad`.
/// routing   in: that of `patched`. out: curves that are followed now are no longer among `unfollowed`.
/// groups    in: those of `patched`. out: with the new patches.
/// h         mean length of the edges of the boundary.
/// features  from `signed_features`.  target  that of `features`.
/// Deterministic, serial. InputError: as `add_pads`. Cost: a few passes over the mesh per curve.
NarrowStrips follow_narrow_strips(PatchedMesh& patched, FeatureRouting& routing, PatchGroups& groups,
                                  const TriangleMesh& target, const SignedFeatures& features, double h);

/// Returns the curves that paths follow in parts, and that run beside a followed curve so that `follow_narrow_strips`
/// may follow them as a whole if the parts are left out; ascending.
std::vector<Index> strips_in_parts(const FeatureRouting& routing, const TriangleMesh& target,
                                   const SignedFeatures& features, double h);

}  // namespace subvol::internal
