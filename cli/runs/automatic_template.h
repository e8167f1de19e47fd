// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cli/runs/loading.h"
#include "cli/runs/run_options.h"
#include "subvol/fit/template_fit.h"

#include <optional>
#include <string>

namespace subvol::cli {

/// Source of a fit's template.
struct TemplateSource {
  std::string path;                  ///< template file; empty: the template is made from the target
  std::optional<std::size_t> cells;  ///< approximate number of cells, if the template is made
};

/// A fit's template, and how it was made, if it was.
struct LoadedTemplate {
  VolumeMesh mesh;  ///< no cells: interrupted while it was being made
  std::optional<AutomaticFitResult> made;
  std::optional<HighOrderMesh> curved{};  ///< curved cells that were read, on the vertices of `mesh`
};

/// Reads a template, or makes one and reports the progress.
///
/// options, use  how the template is made; `cells` is taken from the source instead. Curved cells are read only for
///               `curved_cells`.
/// UsageError: a template would have to be made from points. EndedEarly: the time limit ended it before there was one.
LoadedTemplate load_template(const TemplateSource& source, const Target& target, AutomaticFitOptions options,
                             const RunOptions& run, std::vector<std::string>& warnings,
                             TemplateUse use = TemplateUse::subdivision);

/// Summary of how a template was made in one line, for people.
std::string template_text(const AutomaticFitResult& made);

}  // namespace subvol::cli
