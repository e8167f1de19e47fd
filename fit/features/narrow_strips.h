// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/features/boundary_patches.h"
#include "subvol/fit/features/feature_routing.h"
#include "subvol/fit/features/pads.h"
#include "subvol/fit/features/signed_features.h"
#include "subvol/surface/triangle_mesh.h"

#include <cstddef>
#include <span>
#include <vector>

namespace subvol::internal {

/// Follows curves that run beside a followed one, closer to it than a cell, as those of a chamfer or a small step do.
/// No path of the grid is left for them; the side of a pad is one:
///
///        A   N       B                   A   N   B
///        ----o---o---o           ----o---o           N: followed curve, whose path separates A and B
///            |   |   |               |   |           C: lost curve; R: strip of the target between the two
///            o---o---o   ->      ----o---o C
///            |   |   |               |   | \         .
///                                    o---o---o---o   the pad lies under A; its side is the strip
///
/// The row of faces beside the path that the side of the pad makes becomes a patch of the strip, and the path along its
/// other border follows the lost curve. If a pad under B suits the angles better, the path of N follows C, and the
/// other border N. A pad that is there already serves as well.
///
/// A curve C is followed like this if no path follows any part of it, it is at least h long (`edge_lengths_near`), the
/// distances of each of the two curves from the other are at most 0.95 h, and the region between them is narrow. Closed
/// curves must have no corner. At an open one's end, the row's end may lie on the path of a curve that ends at C's
/// corner there, which is cut back to that corner; the short curve between the corners of N and C follows the end then.
///
/// patched   from `patched_mesh` and `add_pads`. Its positions may gain vertices, as by `pad`.
/// routing   in: that of `patched`. out: curves that are followed now are no longer among `unfollowed`.
/// groups    in: those of `patched`. out: with the new patches.
/// lengths   h near each curve, for curves in `unfollowed`; one entry per curve.
/// returns   the number of curves that are followed now. Deterministic, serial. Cost: a few passes over the mesh per
///           curve.
std::size_t follow_narrow_strips(PatchedMesh& patched, FeatureRouting& routing, PatchGroups& groups,
                                 const TriangleMesh& target, const SignedFeatures& features,
                                 std::span<const double> lengths);

/// Returns the curves that paths follow in parts, and that run beside a followed curve so that `follow_narrow_strips`
/// may follow them as a whole if the parts are left out; ascending.
std::vector<Index> strips_in_parts(const FeatureRouting& routing, const TriangleMesh& target,
                                   const SignedFeatures& features, std::span<const double> lengths);

}  // namespace subvol::internal
