// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/mesh/volume_mesh.h"

#include <cstdint>
#include <span>
#include <vector>

namespace subvol {

/// Lengths that stretch the ideal cell (`element_rule.h`) of each cell along its coordinates, between one size for all
/// (own_share 0) and the cell's own (1):
///
///   h_ci = common^(1 - own_share) own_ci^own_share,  all rescaled so that the stretched ideal cells have the volume
///
/// own_ci is the mean length of a hex's four edges along its direction i; of the edges around a prism's triangles for
/// both directions there, and of those across; of all edges of a tet. A box of the cell's own proportions has the cell
/// pay for shear and for change, not for being long or flat.
///
/// nodes   the vertices' positions; lengths below a thousandth of the common size are raised to it.
/// volume  > 0, in the cube of the nodes' unit.
std::vector<Vec3> ideal_boxes(const VolumeMesh& mesh, std::span<const Vec3> nodes, double volume, double own_share);

/// Boxes (`ideal_boxes`) for a mesh some of whose cells say nothing about the size that is wanted there.
///
/// A trusted cell keeps its own box. The others get cubes whose size runs smoothly between them and the boundary:
///
///   ln h_c = mean of ln h over the cells across its faces, boundary faces taking part with their own edge lengths
///
/// all rescaled to the volume.
///
/// trusted  per cell, whether its own lengths count.  volume  > 0.
/// Without a trusted cell or a boundary all cells get one size. Cost: linear sweeps, some tens of them.
std::vector<Vec3> interpolated_boxes(const VolumeMesh& mesh, std::span<const Vec3> nodes, double volume,
                                     std::span<const std::uint8_t> trusted);

}  // namespace subvol
