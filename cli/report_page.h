// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cli/report_pictures.h"
#include "cli/run_options.h"

#include <span>
#include <string>

namespace subvol::cli {

/// A report as one HTML file: verdict, pictures, figures, energies by iteration, histogram, worst cells, times,
/// command.
///
/// It loads nothing and runs nothing: pictures are in it as data, plots are drawn as SVG, light and dark follow the
/// reader's preference. What a report does not have is left out. notes: said below the pictures.
/// nlohmann's exceptions where entries have other types than `subvol` gives them.
std::string report_page(const Json& report, std::span<const ReportPicture> pictures,
                        std::span<const std::string> notes);

}  // namespace subvol::cli
