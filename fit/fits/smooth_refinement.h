// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/mesh/volume_mesh.h"

namespace subvol::internal {

/// Refines a mesh once by Catmull-Clark subdivision, its boundary vertices at limit positions. Where a cell would get a
/// scaled Jacobian below 0.2, its vertices go half of the way to the multi-linear split, again and again, and at last
/// all of it: the split of a valid mesh is valid.
///
/// mesh  as for `subdivide`; the result carries its tags.
VolumeMesh smooth_refinement(const VolumeMesh& mesh);

}  // namespace subvol::internal
