// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/runs/cage_report.h"

#include "cli/runs/check_report.h"
#include "cli/runs/loading.h"
#include "subvol/base/format.h"

#include <utility>

namespace subvol::cli {

Json cage_json(const VolumeMesh& cage, const MeasuredLimit& limit, double diagonal) {
  Json distance = distance_json(limit.distance, diagonal);
  distance["chord_error_percent"] = 100 * limit.surface.chord_error / diagonal;
  return {{"limit_surface_distance", std::move(distance)}, {"cage", describe("", cage)}};
}

std::string to_text(const MeasuredLimit& limit, double diagonal) {
  const double percent = 100 / diagonal;
  return internal::formatted("%s: mean %g %%, max %g %% of the diagonal\n",
                             limit.distance.one_sided ? "points to limit surface" : "limit surface to target",
                             limit.distance.mean() * percent, limit.distance.max() * percent);
}

}  // namespace subvol::cli
