// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface/point_cloud.h"

#include <string>
#include <vector>

namespace subvol {

/// Points as a cloud that can be fitted, as `read_point_cloud` makes it of those in a file.
///
/// name  where they are from, for messages.
/// returns  points in their order; of those in one place the first, with a warning.
/// InputError: no points, fewer than kLeastCloudPoints places, coordinates that `read_polygon_mesh` refuses.
PointCloud sound_points(std::vector<Vec3> points, const std::string& name,
                        std::vector<std::string>* warnings = nullptr);

}  // namespace subvol
