// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/runs/automatic_template.h"

#include "cli/runs/exit_status.h"
#include "cli/runs/interrupt.h"
#include "cli/runs/progress.h"
#include "subvol/fit/automatic_fit.h"
#include "subvol/surface/region_surface.h"

#include <sstream>

namespace subvol::cli {

namespace {

/// Number of cells of a template for several regions, if none is given: those of curved cells are large.
constexpr std::size_t kRegionTemplateCells = 1500;

}  // namespace

LoadedTemplate load_template(const TemplateSource& source, const Target& target, TemplateChoiceOptions options,
                             const RunOptions& run, std::vector<std::string>& warnings) {
  if (!source.path.empty()) return {load_volume(source.path, warnings, true, run.references), std::nullopt};
  if (is_cloud(target)) throw UsageError("points do not tell what they enclose: give a coarse mesh with --template");
  if (options.time_limit_seconds > 0 && !run.checkpoint.empty())
    warnings.push_back("which template is made depends on how far its trials come within --time-limit: a run that "
                       "--resume's the checkpoint may make another one and be refused; give a --template");
  ProgressTeller teller(run.progress, run.quiet);
  options.cells = source.cells;
  options.progress = [&](const FitProgress& progress) {
    teller.tell(progress);
    return !interrupted();
  };
  options.cancelled = interrupted;
  if (const std::optional<RegionSurface> regions = find_regions(std::get<TriangleMesh>(target))) {
    AutomaticFitOptions fit{.cells = source.cells.value_or(kRegionTemplateCells)};
    fit.crease_angle_degrees = options.crease_angle_degrees.value_or(kUsualCreaseAngle);
    fit.time_limit_seconds = options.time_limit_seconds;
    fit.progress = options.progress;
    fit.cancelled = options.cancelled;
    AutomaticFitResult made = fit_regions(*regions, fit);
    teller.finish();
    warnings.insert(warnings.end(), made.report.warnings.begin(), made.report.warnings.end());
    return {std::move(made.mesh), std::nullopt};
  }
  TemplateChoice choice = choose_template(std::get<TriangleMesh>(target), options);
  teller.finish();
  warnings.insert(warnings.end(), choice.warnings.begin(), choice.warnings.end());
  VolumeMesh mesh = choice.mesh;
  return {std::move(mesh), std::move(choice)};
}

Json choice_json(const TemplateChoice& choice) {
  Json trials = Json::array();
  for (const TemplateTrial& trial : choice.trials)
    trials.push_back({{"cells", trial.cells},
                      {"pillowed", trial.pillowed},
                      {"mean_percent", trial.mean_percent},
                      {"max_percent", trial.max_percent},
                      {"mean_scaled_jacobian", trial.mean_scaled_jacobian},
                      {"self_intersections", trial.self_intersections},
                      {"merit", trial.merit}});
  return {{"components", choice.topology.components},
          {"handles", choice.topology.handles},
          {"cavities", choice.topology.cavities},
          {"trials", std::move(trials)},
          {"chosen", choice.chosen}};
}

std::string to_text(const TemplateChoice& choice) {
  if (choice.trials.empty()) return "no template was chosen\n";
  const TemplateTrial& trial = choice.trials[choice.chosen];
  std::ostringstream text;
  text << "template made: " << trial.cells << " cells" << (trial.pillowed ? ", pillowed" : "") << ", "
       << to_string(choice.topology) << "; best of " << choice.trials.size() << " tried\n";
  return text.str();
}

}  // namespace subvol::cli
