// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cli/runs/cage_report.h"
#include "cli/runs/loading.h"
#include "cli/runs/writing.h"
#include "cli/verbs/long_run.h"
#include "subvol/mesh/fit_state.h"
#include "subvol/mesh/volume_mesh.h"

#include <span>

namespace subvol::cli {

/// The common base of runs whose result is a mesh, or a cage and the mesh that it is subdivided to.
class CageRun : public LongRun {
 protected:
  using LongRun::LongRun;

  /// Writes all outputs. cage: without cells if there is none. states: of the cage, or of the mesh if there is none,
  /// for animations.
  void write_results(const VolumeMesh& cage, const VolumeMesh& mesh, std::span<const FitState> states,
                     const WritingOptions& writing);
  /// Measures the distance between the limit surface of the cage and a target.
  void measure_limit(const VolumeMesh& cage, const Target& target, const WritingOptions& writing);

  MeasuredLimit limit_;

 private:
  void write_cage(const VolumeMesh& cage, const VolumeMesh& mesh, std::span<const FitState> states,
                  const WritingOptions& writing);
};

}  // namespace subvol::cli
