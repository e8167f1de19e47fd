// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/subdivision/subdivision.h"

namespace subvol::internal {

/// Refines several times: V_fine = S_levels ... S_1 V_control.
///
/// levels  0 .. 8.
/// matrix  if not null, receives the product of the S: fine vertices x control vertices.
/// InputError: levels out of range, more cells than can be numbered, and as `subdivide`.
VolumeMesh subdivide_repeatedly(const VolumeMesh& control, int levels, BoundaryRule rule = BoundaryRule::catmull_clark,
                                SparseMap* matrix = nullptr);

/// Splits the cells several times, as `linear_split` does: vertices stay, and children are midpoints. So boundaries,
/// interfaces and the volumes of regions stay, and a mesh that is valid stays valid. Cells, groups and tags are those
/// of `subdivide_repeatedly`. Arguments and InputError: as there.
VolumeMesh split_repeatedly(const VolumeMesh& control, int levels, SparseMap* matrix = nullptr);

}  // namespace subvol::internal
