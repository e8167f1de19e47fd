// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cli/runs/loading.h"
#include "cli/runs/run_options.h"
#include "subvol/fit/template_choice.h"

#include <optional>
#include <string>

namespace subvol::cli {

/// Source of a fit's template.
struct TemplateSource {
  std::string path;                   ///< template file; empty: the template is made from the target
  std::optional<std::size_t> cells;   ///< approximate number of cells, if the template is made
};

/// A fit's template, and how it was chosen if it was made.
struct LoadedTemplate {
  VolumeMesh mesh;                    ///< no cells: interrupted while it was being made
  std::optional<TemplateChoice> choice;
};

/// Reads a template, or makes one and reports the progress.
///
/// options  how the template is made; `cells` is taken from the source instead.
/// UsageError: a template would have to be made from points.
LoadedTemplate load_template(const TemplateSource& source, const Target& target, TemplateChoiceOptions options,
                             const RunOptions& run, std::vector<std::string>& warnings);

/// The report's entry about the choice: the topology, every trial, and the one that was chosen.
Json choice_json(const TemplateChoice& choice);

/// Summary of the choice in one line, for people.
std::string to_text(const TemplateChoice& choice);

}  // namespace subvol::cli
