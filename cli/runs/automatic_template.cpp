// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/runs/automatic_template.h"

#include "cli/runs/exit_status.h"
#include "cli/runs/interrupt.h"
#include "cli/runs/progress.h"
#include "subvol/base/format.h"

#include <utility>

namespace subvol::cli {

using namespace internal;

LoadedTemplate load_template(const TemplateSource& source, const Target& target, AutomaticFitOptions options,
                             const RunOptions& run, std::vector<std::string>& warnings, TemplateUse use) {
  if (!source.path.empty() && use == TemplateUse::curved_cells) {
    LoadedCells cells = load_cells(source.path, warnings, true, run.references);
    if (auto* linear = std::get_if<VolumeMesh>(&cells)) return {std::move(*linear), std::nullopt};
    auto& file = std::get<HighOrderFile>(cells);
    VolumeMesh labels = labels_of(file);
    return {std::move(labels), std::nullopt, std::move(file.mesh)};
  }
  if (!source.path.empty()) return {load_volume(source.path, warnings, true, run.references), std::nullopt};
  if (is_cloud(target)) throw UsageError("points do not tell what they enclose: give a coarse mesh with --template");
  if (options.control.time_limit_seconds > 0 && !run.checkpoint.empty())
    warnings.push_back(
        "which template is made depends on how far its trials come within --time-limit: a run that "
        "--resume's the checkpoint may make another one and be refused; give a --template");
  ProgressTeller teller(run.progress, run.quiet);
  options.cells = source.cells;
  options.control.progress = [&](const FitProgress& progress) {
    teller.tell(progress);
    return !interrupted();
  };
  options.control.cancelled = interrupted;
  AutomaticFitResult made = fit_template(std::get<TriangleMesh>(target), options, use);
  teller.finish();
  if (interrupted()) return {};
  if (made.mesh.num_cells() == 0) throw EndedEarly("nothing to write: " + made.report.explanation, kNotConverged);
  VolumeMesh mesh = made.mesh;
  return {std::move(mesh), std::move(made)};
}

std::string template_text(const AutomaticFitResult& made) {
  const AutomaticFitTrial& trial = made.trials[made.chosen];
  return formatted(
      "template made: %zu cells, least scaled Jacobian %.3f, mean distance %.3g %%, largest %.3g %%; best "
      "of %zu tried\n",
      trial.cells, trial.least_scaled_jacobian, trial.mean_percent, trial.max_percent, made.trials.size());
}

}  // namespace subvol::cli
