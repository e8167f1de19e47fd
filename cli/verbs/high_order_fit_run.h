// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cli/runs/automatic_template.h"
#include "cli/runs/run_options.h"
#include "cli/runs/writing.h"
#include "subvol/fit/high_order_fit.h"

#include <CLI/CLI.hpp>

#include <optional>
#include <string>

namespace subvol::cli {

/// Arguments of `fit --order` or `optimize --order`.
struct HighOrderFitArguments {
  RunOptions run;
  WritingOptions writing;
  HighOrderFitOptions fit;
  std::string target;
  TemplateSource template_mesh;
  const char* command = "fit";  ///< the verb, for messages and the report
  /// True: all invalid cells of the template are untangled first. False: only if the template has few inverted cells.
  bool untangles = false;
  bool takes_points = true;               ///< the target may be points
  std::optional<double> quality_floor{};  ///< least scaled Jacobian that counts as a success
  AutomaticFitOptions template_fit{};     ///< how a template is made if none is given; the time limit is that of `fit`
};

/// Fits curved elements from files to files; returns an ExitStatus.
int run_high_order_fit(const HighOrderFitArguments& arguments, const CLI::App& verb);

}  // namespace subvol::cli
