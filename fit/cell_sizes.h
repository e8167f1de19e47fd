// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/volume_mesh.h"

#include <cstdint>
#include <span>
#include <vector>

namespace subvol {

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
