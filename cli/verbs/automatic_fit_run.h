// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cli/runs/run_options.h"
#include "cli/runs/writing.h"
#include "subvol/fit/automatic_fit.h"
#include "subvol/templates/auto_template.h"

#include <CLI/CLI.hpp>

#include <cstddef>
#include <optional>
#include <string>

namespace subvol::cli {

/// Largest number of cells that a fit may be asked for.
inline constexpr std::size_t kMostRequestedCells = 8 * kMostTemplateCells;

/// Arguments of `fit` without a template, for a mesh whose vertices are all free, or for a cage and its mesh.
struct AutomaticFitArguments {
  RunOptions run;
  WritingOptions writing;
  AutomaticFitOptions fit;
  /// Distances that cost the exit status if they are missed, in percent of the diagonal.
  std::optional<double> mean_tolerance_percent, max_tolerance_percent;
  std::optional<double> least_quality;  ///< the same for the least scaled Jacobian
  std::string target;
  std::optional<double> wrap_percent;         ///< `WrapOptions::voxel_percent`; nothing: the target is not wrapped
  std::optional<double> size;                 ///< edge length of the cells, in the target's unit; replaces fit.cells
  std::vector<std::string> unused_options{};  ///< names, without dashes, of options whose defaults play no part here
};

/// Fills a surface with hexes from files to files; returns an ExitStatus.
int run_automatic_fit(const AutomaticFitArguments& arguments, const CLI::App& verb);

}  // namespace subvol::cli
