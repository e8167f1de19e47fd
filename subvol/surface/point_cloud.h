// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"

#include <vector>

namespace subvol {

/// Points on a surface in no particular order, as a scanner delivers them. The surface between them is not known.
struct PointCloud {
  std::vector<Vec3> points;
};

}  // namespace subvol
