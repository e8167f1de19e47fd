// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/template_command.h"

#include "cli/check_report.h"
#include "cli/exit_status.h"
#include "cli/outputs.h"
#include "cli/report.h"
#include "fit/mesh_check.h"
#include "subvol/version.h"

#include <iostream>

namespace subvol::cli {

void add_template_options(CLI::App& verb, TemplateRun& run) {
  add_output_options(
      verb, run.run,
      "The template, or its boundary, by extension: " + output_formats() + "; may be given several times");
  verb.add_option("--report", run.run.report, "Write what was done and what is true of the result")
      ->type_name("FILE.json");
}

std::vector<Output> template_outputs(const TemplateRun& run, const CLI::App& verb) {
  if (run.run.outputs.empty() && run.run.report.empty())
    throw UsageError("template " + verb.get_name() + ": nothing to write; give -o FILE or --report FILE");
  std::vector<Output> outputs = checked_outputs(run.run, {Part::cutaway});
  apply_resources(run.run);
  return outputs;
}

int write_template(const TemplateRun& run, const CLI::App& verb, std::vector<Output> outputs,
                   const VolumeMesh& mesh, const Json& details) {
  WritingOptions writing = run.writing;
  writing.options = options_of_result(verb);
  const MeshCheck check = check_mesh(mesh);
  const std::vector<std::string> failures =
      write_each(outputs, [&](const Output& output) { write_output(output, mesh, writing); });
  if (!run.run.report.empty()) {
    Json json{{"subvol", version()}, {"command", "template " + verb.get_name()}, {"options", options_in_force(verb)}};
    json.update(details);
    json.update(check_json(check));
    json["warnings"] = run.warnings;
    json["peak_memory_bytes"] = peak_memory_bytes();
    json["outputs"] = output_names(outputs);
    write_report(run.run.report, json);
  }
  if (!run.run.quiet) {
    for (const std::string& warning : run.warnings) std::cerr << "subvol: warning: " << warning << '\n';
    std::cerr << to_text(check);
    for (const Output& output : outputs) std::cerr << "wrote " << output.path.string() << '\n';
  }
  require_all_written(failures);
  return check.valid() ? kDone : kFailed;
}

void add_template_command(CLI::App& app, Action& action) {
  CLI::App* group = app.add_subcommand("template", "Make and edit coarse meshes to fit with");
  group->require_subcommand(1);
  add_template_auto(*group, action);
  add_template_edits(*group, action);
  group->footer("\"subvol template VERB --help\" tells more.");
}

}  // namespace subvol::cli
