// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cli/runs/run_options.h"

#include <string>

namespace subvol::cli {

/// Surface, volume and total energy in every iteration of all stages, logarithmic, as SVG; empty without iterations.
/// Energies that are not positive are drawn at the lower end of the plot.
std::string energy_plot(const Json& stages);

/// Counts in equal bins as bars, as SVG; empty if there are none.
std::string histogram_plot(const Json& counts);

}  // namespace subvol::cli
