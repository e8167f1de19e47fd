// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/automatic_fit.h"
#include "subvol/surface/triangle_mesh.h"

#include <cstddef>
#include <functional>

namespace subvol::internal {

/// Returns true if some borders between groups of a target are no edges sharper than an angle.
/// target  connected by common vertices.
bool has_smooth_borders(const TriangleMesh& target, double angle_degrees);

/// Returns the number of groups of a target that a result loses, or whose area differs by more than what is reported
/// (`kMostAreaDifference`).
std::size_t num_groups_missed(const TriangleMesh& target, const VolumeMesh& mesh);

/// An automatic fit that follows smooth borders of groups as well as sharp edges (`true`) or not, with options.
using GroupedFit = std::function<AutomaticFitResult(bool follows_borders, const AutomaticFitOptions& options)>;

/// Fits without smooth borders of groups. If groups are missed then, fits again with them. That result is returned if
/// it is valid, misses fewer groups, and is good (`is_good_enough`) or has no higher merit than the first; each missed
/// group adds 0.1 to the merit, up to 1. Trials, stages and seconds of both are in the report.
///
/// The second fit has what is left of the time limit; there is none if the first ended early.
AutomaticFitResult fit_for_groups(const TriangleMesh& target, const AutomaticFitOptions& options,
                                  const GroupedFit& fit);

}  // namespace subvol::internal
