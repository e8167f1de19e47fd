// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cli/runs/run_options.h"

#include <filesystem>
#include <string>
#include <vector>

namespace subvol::cli {

/// A picture of a report; all of them are drawn from the same side and at the same scale.
struct ReportPicture {
  std::string title;
  std::string png;                 ///< the file's bytes, transparent where nothing is drawn
  std::string low, high;           ///< meanings of the two ends of the color scale; empty: no colors
};

/// Draws the meshes of a report from the files that it names: the surface, the template, and the result colored by
/// distance to the surface and by quality.
///
/// folder   where relative names are looked up besides the current folder.
/// notes    receives a line for every picture that could not be made, with the reason.
/// The result is the first output that holds as many cells as the report says.
std::vector<ReportPicture> report_pictures(const Json& report, const std::filesystem::path& folder,
                                           std::vector<std::string>& notes);

}  // namespace subvol::cli
