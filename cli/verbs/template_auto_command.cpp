// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/runs/diagnosis_report.h"
#include "cli/runs/exit_status.h"
#include "cli/runs/interrupt.h"
#include "cli/runs/loading.h"
#include "cli/runs/outputs.h"
#include "cli/runs/progress.h"
#include "cli/verbs/template_command.h"
#include "cli/verbs/verb_options.h"
#include "subvol/base/error.h"
#include "subvol/fit/target/surface_diagnosis.h"
#include "subvol/io/label_grid_io.h"
#include "subvol/io/surface_io.h"
#include "subvol/mesh/interfaces.h"
#include "subvol/templates/auto_template.h"
#include "subvol/templates/pillow.h"
#include "subvol/templates/region_template.h"

#include <chrono>
#include <iostream>
#include <memory>

namespace subvol::cli {

using namespace internal;
namespace {

struct AutoArguments : TemplateRun {
  std::string target;
  AutoTemplateOptions options;
  std::string regions;
  std::optional<double> wrap_percent;
  double time_limit_seconds = 0;  ///< 0: none
};

/// Calls search(progress), progress(fraction) being false if the search must end.
template <class Search>
auto make(const AutoArguments& arguments, const Search& search) {
  ProgressTeller teller(arguments.run.progress, arguments.run.quiet);
  const auto start = std::chrono::steady_clock::now();
  const auto in_time = [&] {
    const std::chrono::duration<double> passed = std::chrono::steady_clock::now() - start;
    return arguments.time_limit_seconds == 0 || passed.count() < arguments.time_limit_seconds;
  };
  auto result = search([&](double fraction) {
    teller.tell({.stage = "template", .level = 0, .iteration = 0, .energy = 0, .fraction = fraction});
    return !interrupted() && in_time();
  });
  teller.finish();
  return result;
}

int out_of_time() {
  std::cerr << "subvol: the time limit was reached before a template was made\n";
  return kNotConverged;
}

Json topology_json(const BettiNumbers& topology) {
  return {{"components", topology.components},
          {"handles", topology.handles},
          {"cavities", topology.cavities},
          {"euler_number", topology.euler_number()}};
}

int run_with_regions(AutoArguments arguments, const CLI::App& verb, const std::vector<Output>& outputs,
                     const SurfaceRepair& repair) {
  const RegionSurface& target = *repair.regions;
  const RegionTemplateResult result = make(arguments, [&](auto progress) {
    return region_template(target, {arguments.options.cells, arguments.options.pillow, progress});
  });
  if (result.cancelled && interrupted()) return kInterrupted;
  if (!result.made && result.cancelled) return out_of_time();
  if (!result.made)
    throw InputError(arguments.target +
                     ": no grid that was tried has the topology of the target's regions; ask for more --cells");
  const RegionTemplate& made = *result.made;
  VolumeMesh mesh = arguments.options.pillow ? pillow_regions(made.mesh) : made.mesh;
  add_interface_groups(mesh);
  const bool as_asked = made.cells_asked == arguments.options.cells && made.wrong_sheets == 0;
  if (made.cells_asked != arguments.options.cells)
    arguments.warnings.push_back(std::to_string(arguments.options.cells) +
                                 " cells cannot carry the topology of the target's regions; --cells " +
                                 std::to_string(made.cells_asked) + " does");
  if (made.wrong_sheets > 0)
    arguments.warnings.push_back(std::to_string(made.wrong_sheets) +
                                 " interfaces or parts of the boundary have another topology than in the target");
  const int status = write_template(arguments, verb, outputs, mesh,
                                    {{"input", {{"target", describe(arguments.target, repair.surface)}}},
                                     {"repairs", repair.done},
                                     {"template",
                                      {{"cells", mesh.num_cells()},
                                       {"cells_that_work", made.cells_asked},
                                       {"pillowed", arguments.options.pillow},
                                       {"regions", target.regions.size()},
                                       {"wrong_sheets", made.wrong_sheets}}}});
  return status == kDone && !as_asked ? kNotConverged : status;
}

int run_auto(AutoArguments arguments, const CLI::App& verb) {
  const std::vector<Output> outputs = template_outputs(arguments, verb);
  const SurfaceRepair repair =
      load_to_fill(arguments.target, {region_rule(arguments.regions), arguments.wrap_percent}, arguments.warnings);
  const TriangleMesh& target = repair.surface;
  add_remarks(repair, arguments.warnings);
  arguments.writing.source = arguments.target;
  if (repair.regions) return run_with_regions(arguments, verb, outputs, repair);
  const AutoTemplateResult result = make(arguments, [&](auto progress) {
    AutoTemplateOptions options = arguments.options;
    options.progress = progress;
    return auto_templates(target, options);
  });
  if (result.cancelled && interrupted()) return kInterrupted;
  if (result.cancelled) return out_of_time();
  if (result.templates.empty()) {
    const SurfaceDiagnosis diagnosis = diagnose(target, interrupted);
    if (interrupted()) return kInterrupted;
    throw InputError(arguments.target + ": " + why_no_grid(diagnosis, arguments.options.cells, result.wanted));
  }
  const AutoTemplate& made = result.templates.front();
  const bool as_asked = made.cells_asked == arguments.options.cells;
  if (!as_asked)
    arguments.warnings.push_back(std::to_string(arguments.options.cells) + " cells cannot carry the target's " +
                                 to_string(result.wanted) + "; --cells " + std::to_string(made.cells_asked) + " does");
  Json axes = Json::array();
  for (int a = 0; a < 3; ++a) axes.push_back({made.axes(0, a), made.axes(1, a), made.axes(2, a)});
  const int status = write_template(arguments, verb, outputs, made.mesh,
                                    {{"input", {{"target", describe(arguments.target, target)}}},
                                     {"repairs", repair.done},
                                     {"template",
                                      {{"cells", made.mesh.num_cells()},
                                       {"cells_that_work", made.cells_asked},
                                       {"pillowed", made.pillowed},
                                       {"wanted", topology_json(result.wanted)},
                                       {"topology", topology_json(made.topology)},
                                       {"score", made.score},
                                       {"axes", axes},
                                       {"grids", result.grids},
                                       {"candidates", result.candidates}}}});
  return status == kDone && !as_asked ? kNotConverged : status;
}

}  // namespace

void add_template_auto(CLI::App& group, Action& action) {
  CLI::App* verb = group.add_subcommand("auto", "Make a template from a surface: a carved grid with its topology");
  const auto arguments = std::make_shared<AutoArguments>();
  verb->add_option("TARGET", arguments->target,
                   "Surface that bounds a solid: " + surface_formats() +
                       "; a volume mesh, for its boundary; or a segmentation: " + label_grid_formats())
      ->required()
      ->type_name("FILE");
  verb->add_option("--cells", arguments->options.cells, "Approximate number of cells; more if the topology needs them")
      ->check(whole_number_in(kLeastTemplateCells, kMostTemplateCells))
      ->type_name("N")
      ->capture_default_str();
  verb->add_flag("--pillow", arguments->options.pillow, "Put a layer of cells around the whole boundary, counted in");
  add_regions_option(*verb, arguments->regions);
  add_wrap_option(*verb, arguments->wrap_percent);
  verb->add_option("--time-limit", arguments->time_limit_seconds, "End after this time, without a template")
      ->check(number_in(1e-3, 1e9))
      ->type_name("SECONDS");
  add_template_options(*verb, *arguments);
  verb->add_option("--progress", arguments->run.progress,
                   "How progress is shown: bar (default on a terminal) or plain on stderr, json on stdout, none")
      ->check(CLI::IsMember({"bar", "plain", "json", "none"}))
      ->type_name("KIND");
  verb->footer(
      R"(Exit status 4: so many cells cannot carry the topology; the template has more.
Status 3: no grid that was tried can.

Example:
  subvol template auto bone.off --cells 300 -o bone_template.mesh)");
  verb->callback([arguments, verb, &action] { action = [arguments, verb] { return run_auto(*arguments, *verb); }; });
}

}  // namespace subvol::cli
