// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/runs/untangling.h"

#include "cli/runs/exit_status.h"
#include "cli/runs/interrupt.h"
#include "cli/runs/progress.h"
#include "subvol/base/error.h"
#include "subvol/fit/untangle_before_fit.h"
#include "subvol/mesh/validate.h"

#include <algorithm>

namespace subvol::cli {

bool has_few_inverted_cells(const VolumeMesh& mesh) {
  const std::vector<MeshDefect> defects = validate(mesh);
  const auto inverted = std::count_if(defects.begin(), defects.end(), [](const MeshDefect& defect) {
    return defect.kind == MeshDefect::Kind::inverted_cell;
  });
  return inverted > 0 && 2 * static_cast<std::size_t>(inverted) < mesh.num_cells();
}

namespace {

/// Runs untangle(progress, cancelled), which returns an `UntangledStart`, and reports what it did.
template <class Untangle>
void untangle_and_report(const std::string& path, const RunOptions& run, std::vector<std::string>& warnings,
                         const Untangle& untangle) {
  ProgressTeller teller(run.progress, run.quiet);
  const auto progress = [&](const FitProgress& now) {
    teller.tell(now);
    return !interrupted();
  };
  try {
    const UntangledStart start = untangle(progress, interrupted);
    if (start.ended_early())
      throw EndedEarly(path + ": the work was ended while its cells were made valid; " + std::to_string(start.left) +
                           " were not yet, and there is nothing to write",
                       start.stop_reason == StopReason::cancelled ? kInterrupted : kNotConverged);
    if (start.tangled > 0)
      warnings.push_back(path + ": " + std::to_string(start.tangled) +
                         " cells were not valid; they were untangled before the fit");
  } catch (const InputError& error) {
    throw InputError(path + ": " + error.what());
  }
  teller.finish();
}

}  // namespace

void untangle_template(const std::string& path, const RunOptions& run, OptimizeOptions options, VolumeMesh& mesh,
                       std::vector<std::string>& warnings) {
  untangle_and_report(path, run, warnings, [&](const auto& progress, const auto& cancelled) {
    options.control.progress = progress;
    options.control.cancelled = cancelled;
    return untangle_before_fit(mesh, options);
  });
}

void untangle_template(const std::string& path, const RunOptions& run, const OptimizeOptions& options,
                       const VolumeMesh& labels, HighOrderMesh& mesh, std::vector<std::string>& warnings) {
  untangle_and_report(path, run, warnings, [&](const auto& progress, const auto& cancelled) {
    SolveControl control = options.control;
    control.progress = progress;
    control.cancelled = cancelled;
    return untangle_before_fit(mesh, labels, {.control = control, .tuning = options.tuning});
  });
}

}  // namespace subvol::cli
