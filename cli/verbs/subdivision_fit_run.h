// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cli/runs/automatic_template.h"
#include "cli/runs/run_options.h"
#include "cli/runs/writing.h"
#include "subvol/fit/automatic_fit.h"
#include "subvol/fit/subdivision_fit.h"

#include <CLI/CLI.hpp>

#include <cstddef>
#include <optional>
#include <string>

namespace subvol::cli {

/// Arguments of `fit` for a subdivision volume.
struct SubdivisionFitArguments {
  RunOptions run;
  WritingOptions writing;
  FitOptions fit;
  std::string target;
  TemplateSource template_mesh;
  std::optional<std::size_t> cells{};     ///< of the result, if the template is made
  std::optional<double> quality_floor{};  ///< least scaled Jacobian that counts as a success
  AutomaticFitOptions template_fit{};     ///< how a template is made if none is given; the time limit is that of `fit`
};

/// Fits a subdivision volume to a template from files to files; returns an ExitStatus.
int run_subdivision_fit(const SubdivisionFitArguments& arguments, const CLI::App& verb);

}  // namespace subvol::cli
