// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cli/runs/loading.h"
#include "cli/runs/run_options.h"
#include "fit/template_choice.h"

#include <optional>
#include <string>

namespace subvol::cli {

/// Where a fit's template comes from.
struct TemplateSource {
  std::string path;                   ///< of a file; empty: made from the target
  std::optional<std::size_t> cells;   ///< about how many, where it is made
};

/// A fit's template, and how it was chosen where it was made.
struct LoadedTemplate {
  VolumeMesh mesh;                    ///< no cells: interrupted while it was being made
  std::optional<TemplateChoice> choice;
};

/// Reads a template, or makes one and tells how far that is.
///
/// options  how it is made, but for the count, which is the source's.
/// UsageError: one is to be made from points.
LoadedTemplate load_template(const TemplateSource& source, const Target& target, TemplateChoiceOptions options,
                             const RunOptions& run, std::vector<std::string>& warnings);

/// What a report says of the choice: the topology, every trial, and which one was taken.
Json choice_json(const TemplateChoice& choice);

/// The same for people, one line.
std::string to_text(const TemplateChoice& choice);

}  // namespace subvol::cli
