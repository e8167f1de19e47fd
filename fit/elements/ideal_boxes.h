// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/mesh/volume_mesh.h"

#include <cstdint>
#include <span>
#include <vector>

namespace subvol::internal {

/// Returns the mean lengths of a cell's edges. Hex: along the three directions; prism: of the triangles' edges (twice)
/// and of the upright edges; tet: of all edges (three times); pyramid: along the two directions of the base, and of the
/// other edges.
Vec3 box_lengths(CellKind kind, std::span<const Index> cell, std::span<const Vec3> nodes);

/// Lengths by which to stretch the ideal cell (`element_rule.h`) of each cell along its coordinates, between one size
/// for all cells (own_share 0) and the cell's own size (1):
///
///   h_ci = common^(1 - own_share) own_ci^own_share,  rescaled so that all stretched ideal cells have the volume
///
/// own_ci is a mean edge length. Hex: that of the four edges along direction i; prism: that of the triangles' edges for
/// the two directions in them, that of the upright edges for the third; tet: that of all edges. With a box of its own
/// proportions, a cell pays for shear and for change, not for being long or flat.
///
/// nodes   the vertices' positions; lengths below a thousandth of the common size are raised to that.
/// volume  > 0, in the cube of the nodes' unit.
std::vector<Vec3> ideal_boxes(const VolumeMesh& mesh, std::span<const Vec3> nodes, double volume, double own_share);

/// Boxes (`ideal_boxes`) for a mesh in which some cells say nothing about the size that is wanted there.
///
/// A trusted cell keeps its own box. The others get cubes whose size varies smoothly between those and the boundary:
///
///   ln h_c = mean of ln h over the cells across its faces; boundary faces contribute the mean of their edge lengths
///
/// All are rescaled to the volume.
///
/// trusted  per cell: nonzero if its own lengths count.  volume  > 0.
/// Without a trusted cell or a boundary, all cells get one size. Cost: linear sweeps, some tens of them.
std::vector<Vec3> interpolated_boxes(const VolumeMesh& mesh, std::span<const Vec3> nodes, double volume,
                                     std::span<const std::uint8_t> trusted);

}  // namespace subvol::internal
