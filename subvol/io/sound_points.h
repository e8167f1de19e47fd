// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface/point_cloud.h"

#include <string>
#include <vector>

namespace subvol::internal {

/// Checks points and returns a cloud that can be fitted, as `read_point_cloud` does with the points of a file.
///
/// name     source of the points for messages.
/// returns  the points in their order. Dropped, with a warning: all but the first of points in one place.
/// InputError: no points, fewer than kLeastCloudPoints places, or coordinates that `read_polygon_mesh` refuses.
PointCloud sound_points(std::vector<Vec3> points, const std::string& name,
                        std::vector<std::string>* warnings = nullptr);

}  // namespace subvol::internal
