// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cli/runs/report_meshes.h"
#include "cli/runs/run_options.h"

#include <string>
#include <vector>

namespace subvol::cli {

/// A picture of a report; all of them are drawn from the same side and at the same scale.
struct ReportPicture {
  std::string title;
  std::string png;        ///< the file's bytes, transparent where nothing is drawn
  std::string low, high;  ///< meanings of the two ends of the color scale; empty: no colors
};

/// Draws the meshes of a report: the surface, the mesh that was given, the result colored by distance to the surface
/// and by quality, and the result cut open. If the result has a control cage, its limit surface is drawn.
///
/// notes    receives a line for every picture that could not be made, with the reason.
std::vector<ReportPicture> report_pictures(const Json& report, const ReportMeshes& meshes,
                                           std::vector<std::string>& notes);

}  // namespace subvol::cli
