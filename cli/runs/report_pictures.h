// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cli/runs/run_options.h"

#include <filesystem>
#include <string>
#include <vector>

namespace subvol::cli {

/// A picture of a report, all of them from the same side and at the same scale.
struct ReportPicture {
  std::string title;
  std::string png;                 ///< the file's bytes, transparent where there is nothing
  std::string low, high;           ///< what the ends of the colour scale mean; empty: no colours
};

/// Draws what a report speaks of, from the files it names: the surface, the template, and the result by distance to the
/// surface and by quality.
///
/// folder   where relative names are looked for besides the current folder.
/// notes    gets a line for every picture that could not be made, with the reason.
/// The result is the first output that holds as many cells as the report says.
std::vector<ReportPicture> report_pictures(const Json& report, const std::filesystem::path& folder,
                                           std::vector<std::string>& notes);

}  // namespace subvol::cli
