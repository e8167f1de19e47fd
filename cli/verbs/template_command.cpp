// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/verbs/template_command.h"

#include "cli/runs/exit_status.h"
#include "cli/runs/losses.h"
#include "cli/runs/outputs.h"
#include "cli/runs/written_result.h"
#include "cli/verbs/verb_options.h"

#include <utility>

namespace subvol::cli {

void add_template_options(CLI::App& verb, TemplateRun& run) {
  add_output_options(
      verb, run.run,
      "The template, or its boundary, by extension: " + output_formats() + "; may be given several times");
  add_msh_version_option(verb, run.writing);
  verb.add_option("--report", run.run.report, "Write what was done and what is true of the result")
      ->type_name("FILE.json");
}

std::vector<Output> template_outputs(const TemplateRun& run, const CLI::App& verb) {
  if (run.run.outputs.empty() && run.run.report.empty())
    throw UsageError("template " + verb.get_name() + ": nothing to write; give -o FILE or --report FILE");
  std::vector<Output> outputs = checked_outputs(run.run, {Part::cutaway, Part::boundary});
  apply_resources(run.run);
  return outputs;
}

int write_template(const TemplateRun& run, const CLI::App& verb, std::vector<Output> outputs, const VolumeMesh& mesh,
                   const Json& details) {
  WritingOptions writing = run.writing;
  writing.options = options_of_result(verb);
  Json report{{"command", "template " + verb.get_name()}, {"options", options_in_force(verb)}};
  report.update(details);
  std::vector<std::string> warnings = unused_output_options(verb, outputs);
  warnings.insert(warnings.end(), run.warnings.begin(), run.warnings.end());
  warn_of_names(marks_of(mesh), outputs, warnings);
  return write_checked(
      run.run, std::move(outputs), mesh, [&](const Output& output) { write_output(output, mesh, writing); }, warnings,
      report);
}

void add_template_command(CLI::App& app, Action& action) {
  CLI::App* group = app.add_subcommand("template", "Make and edit coarse meshes to fit with");
  group->require_subcommand(1);
  add_template_auto(*group, action);
  add_template_edits(*group, action);
  group->footer("\"subvol template VERB --help\" tells more.");
}

}  // namespace subvol::cli
