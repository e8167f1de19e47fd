// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "cli/runs/run_options.h"
#include "subvol/fit/automatic_fit.h"

namespace subvol::cli {

/// The report's entries about an automatic fit: the topology, every template that was tried and the one that was chosen
/// ("template"), how well sharp edges are met ("creases"), and which are not followed ("edges_not_followed").
Json automatic_fit_json(const AutomaticFitResult& result);

}  // namespace subvol::cli
