// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cli/runs/report_pictures.h"
#include "cli/runs/run_options.h"

#include <span>
#include <string>
#include <string_view>

namespace subvol::cli {

/// Reads a report from the bytes of a file. InputError, naming the file: the text is not JSON, is nested deeper than
/// any report, or is not a report of `subvol`. Entries may still be missing or of other types.
Json parse_report(std::string_view bytes, const std::string& name);

/// Returns a report as one HTML file: verdict, pictures, figures, energies by iteration, histogram, worst cells, times,
/// command.
///
/// The page loads nothing: pictures are embedded as data, plots are drawn as SVG, and the light or dark style follows
/// the reader's preference. Sections without data in the report are left out.
///
/// viewer  HTML of `viewer_element`, shown before the pictures; the only part that runs a script. Empty: none.
/// notes   listed below the pictures.
/// nlohmann's exceptions if entries have other types, or fewer parts, than `subvol` gives them.
std::string report_page(const Json& report, std::string_view viewer, std::span<const ReportPicture> pictures,
                        std::span<const std::string> notes);

}  // namespace subvol::cli
