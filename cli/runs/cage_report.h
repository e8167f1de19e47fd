// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cli/runs/report.h"
#include "subvol/export/tessellate.h"
#include "subvol/fit/mesh_check.h"
#include "subvol/mesh/volume_mesh.h"

#include <string>

namespace subvol::cli {

/// The tessellated limit surface of a cage, and its distance to the target.
struct MeasuredLimit {
  TessellatedSurface surface;
  SurfaceDistance distance;

  /// Mean distance in percent of a diagonal.
  double mean_percent(double diagonal) const { return 100 * distance.mean() / diagonal; }
};

/// Returns the entries of a report about a cage.
Json cage_json(const VolumeMesh& cage, const MeasuredLimit& limit, double diagonal);

/// Returns a line about the limit surface.
std::string to_text(const MeasuredLimit& limit, double diagonal);

}  // namespace subvol::cli
