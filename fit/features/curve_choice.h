// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/features/feature_routing.h"
#include "subvol/fit/features/pads.h"
#include "subvol/fit/features/signed_features.h"

#include <span>

namespace subvol::internal {

/// Excludes curves from the next routing because cells at their paths came out poor.
///
/// A curve is at fault by the sum of its cells' faults, divided by its length. If joined curves are at fault, they may
/// no longer join. Otherwise the worst third of the curves at fault is excluded, at least one.
///
/// patched    the mesh that was fitted.
/// routing    the routing that it comes from, made with these options.
/// faults     one entry per cell of `patched.mesh`, >= 0: 0 for a good cell, the more the worse it is; for instance
///            max(0, 0.3 - scaled Jacobian), or 1 at a face that meets another one.
/// options    in: those of the routing. out: those for the next one.
/// returns    false if no curve is at fault; the options then mean the same. Each call that returns true excludes a
///            curve or forbids it to join, so that a loop of routings and calls ends.
/// InputError: sizes that do not agree, a path of a curve that does not exist.
bool give_up_poor_curves(const PatchedMesh& patched, const SignedFeatures& features, const FeatureRouting& routing,
                         std::span<const double> faults, RoutingOptions& options);

}  // namespace subvol::internal
