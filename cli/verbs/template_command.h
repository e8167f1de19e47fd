// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cli/runs/run_options.h"
#include "cli/runs/writing.h"
#include "cli/verbs/commands.h"
#include "subvol/mesh/volume_mesh.h"

#include <string>
#include <vector>

namespace subvol::cli {

/// State shared by all verbs under `template`.
struct TemplateRun {
  RunOptions run;
  WritingOptions writing;
  std::vector<std::string> warnings;
};

/// -o and the other output options, --report.
void add_template_options(CLI::App& verb, TemplateRun& run);

/// The outputs of a verb under `template`, checked before any work. UsageError: none are given.
std::vector<Output> template_outputs(const TemplateRun& run, const CLI::App& verb);

/// Writes a template, its report (`details` and the common entries) and a summary, as `write_checked`.
int write_template(const TemplateRun& run, const CLI::App& verb, std::vector<Output> outputs, const VolumeMesh& mesh,
                   const Json& details);

/// Each adds one group of verbs.
void add_template_auto(CLI::App& group, Action& action);
void add_template_edits(CLI::App& group, Action& action);

}  // namespace subvol::cli
