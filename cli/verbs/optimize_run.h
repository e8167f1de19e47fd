// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cli/runs/run_options.h"
#include "cli/runs/writing.h"
#include "subvol/fit/high_order_fit.h"
#include "subvol/fit/optimize_mesh.h"

#include <CLI/CLI.hpp>

#include <string>

namespace subvol::cli {

struct OptimizeArguments {
  RunOptions run;
  WritingOptions writing;
  OptimizeOptions optimize;
  std::string mesh, target, sizes = "local", basis = to_string(HighOrderFitOptions{}.basis);
  int order = 1;
};

/// Optimizes linear or curved cells from files to files; returns an ExitStatus.
int run_optimize(const OptimizeArguments& arguments, const CLI::App& verb);

}  // namespace subvol::cli
