// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"

#include <Eigen/Geometry>

#include <functional>
#include <span>

namespace subvol::internal {

/// Calls visit(a, b) once for each two boxes that meet, with their places, in no order of any meaning. An exception of
/// `visit` ends the search. Cost: about n log^2 n for n boxes, and the pairs.
void for_each_box_pair(std::span<const Eigen::AlignedBox3d> boxes, const std::function<void(Index, Index)>& visit);

}  // namespace subvol::internal
