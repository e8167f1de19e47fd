// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/features/followed_creases.h"
#include "subvol/fit/stages/fit_report.h"
#include "subvol/fit/target/fit_target.h"
#include "subvol/mesh/volume_mesh.h"

#include <optional>

namespace subvol::internal {

/// Which edges of the target a fit keeps sharp, as `FitOptions` says.
struct CreaseRule {
  std::optional<double> angle_degrees{};
  bool keeps_groups = false;
  /// False: if the template has creases, only those are followed; if not, edges are followed only if the target is a
  /// designed part (`EdgeCrispness::is_designed`).
  bool follows_all_edges = true;
};

/// Tags a template, in normalized coordinates, with the creases that follow these edges of the target. Without an
/// angle, those of its own creases are followed that lie along sharp edges. Returns no creases if the target is a
/// cloud.
FollowedCreases creases_along_target(const FitTarget& target, const CreaseRule& rule, VolumeMesh& template_mesh);

/// Makes the interfaces between the template's regions follow those that the target has, or keep their own shape, sharp
/// edges included. If the target is a cloud, adds a warning to the report that they are not kept.
void keep_interfaces(const CreaseRule& rule, FitTarget& target, FollowedCreases& creases, VolumeMesh& template_mesh,
                     FitReport& report);

}  // namespace subvol::internal
