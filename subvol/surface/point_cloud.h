// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"

#include <vector>

namespace subvol {

/// Points on a surface, in no order: what a scanner delivers. Nothing is known of what lies between them.
struct PointCloud {
  std::vector<Vec3> points;
};

}  // namespace subvol
