// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cli/runs/report_pictures.h"
#include "cli/runs/run_options.h"

#include <span>
#include <string>
#include <string_view>

namespace subvol::cli {

/// A report from the bytes of a file. InputError, naming the file: no JSON, values nested deeper than any report's, or
/// not what `subvol` writes. Entries may still be missing or of other types.
Json parse_report(std::string_view bytes, const std::string& name);

/// A report as one HTML file: verdict, pictures, figures, energies by iteration, histogram, worst cells, times,
/// command.
///
/// It loads nothing and runs nothing: pictures are in it as data, plots are drawn as SVG, light and dark follow the
/// reader's preference. What a report does not have is left out. notes: said below the pictures.
/// nlohmann's exceptions where entries have other types, or fewer parts, than `subvol` gives them.
std::string report_page(const Json& report, std::span<const ReportPicture> pictures,
                        std::span<const std::string> notes);

}  // namespace subvol::cli
