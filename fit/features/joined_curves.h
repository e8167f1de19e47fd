// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/features/feature_curves.h"
#include "subvol/fit/features/feature_routing.h"
#include "subvol/fit/features/signed_features.h"
#include "subvol/mesh/volume_mesh.h"

namespace subvol::internal {

/// Returns the curves as far as their paths can follow them: the curve of a joined path starts on the curve whose path
/// it joins, as far from the corner as the two paths part, and goes on along its own; a curve of
/// `FeatureRouting::parts` is cut to the first of them, and its other parts are added as curves at the end, in the
/// order of their paths. mesh, features, routing  as for and from `route_features`.
FeatureCurves followed_parts(const VolumeMesh& mesh, const SignedFeatures& features, const FeatureRouting& routing);

/// Renames the curves of a routing's paths to those that `followed_parts` returns.
/// paths  of the routing, in its order.  num_curves  of all features.
std::vector<CreasePath> paths_of_parts(std::vector<CreasePath> paths, std::size_t num_curves);

}  // namespace subvol::internal
