// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cli/runs/cage_report.h"
#include "cli/runs/loading.h"
#include "cli/runs/writing.h"
#include "python/work.h"
#include "subvol/fit/mesh_check.h"

#include <variant>

namespace subvol::python {

/// Tessellates the limit surface of a cage as for a .glb, and measures its distance to a target.
inline cli::MeasuredLimit measured_limit(const VolumeMesh& cage, const cli::Target& target,
                                         const cli::WritingOptions& writing, Work& work) {
  cli::MeasuredLimit limit;
  limit.surface = work.run("limit", [&] { return cli::tessellated_limit(cage, writing); });
  limit.distance = work.run("distance", [&] {
    return std::visit([&](const auto& t) { return surface_distance(triangles_of(limit.surface), t); }, target);
  });
  return limit;
}

}  // namespace subvol::python
