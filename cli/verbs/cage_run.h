// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cli/runs/check_report.h"
#include "cli/runs/loading.h"
#include "cli/runs/report.h"
#include "cli/runs/writing.h"
#include "cli/verbs/long_run.h"
#include "subvol/export/tessellate.h"
#include "subvol/mesh/fit_state.h"
#include "subvol/mesh/volume_mesh.h"

#include <span>
#include <string>

namespace subvol::cli {

/// The common base of runs whose result is a cage and the mesh that it is subdivided to.
class CageRun : public LongRun {
 protected:
  using LongRun::LongRun;

  /// Writes all outputs. states: of the cage, for animations.
  void write_cage(const VolumeMesh& cage, const VolumeMesh& mesh, std::span<const FitState> states,
                  const WritingOptions& writing);
  /// Measures the distance between the limit surface of the cage and a target.
  void measure_limit(const VolumeMesh& cage, const Target& target, const WritingOptions& writing);
  /// Mean distance of the limit surface, in percent of a diagonal.
  double limit_mean_percent(double diagonal) const { return 100 * limit_distance_.mean() / diagonal; }
  /// Returns the entries of a report about a cage.
  Json cage_json(const VolumeMesh& cage, double diagonal) const;
  /// Returns a line about the limit surface.
  std::string limit_text(double diagonal) const;

 private:
  TessellatedSurface limit_;
  SurfaceDistance limit_distance_;
};

}  // namespace subvol::cli
