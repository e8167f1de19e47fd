// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/features/feature_curves.h"
#include "subvol/fit/features/feature_routing.h"
#include "subvol/fit/features/signed_features.h"
#include "subvol/mesh/volume_mesh.h"

namespace subvol::internal {

/// Returns the curves as far as their paths can follow them: the curve of a joined path starts on the curve whose path
/// it joins, as far from the corner as the two paths part, and goes on along its own; curves of `FeatureRouting::parts`
/// are cut to these; all others are unchanged.
/// mesh, features, routing  as for and from `route_features`.
FeatureCurves followed_parts(const VolumeMesh& mesh, const SignedFeatures& features, const FeatureRouting& routing);

}  // namespace subvol::internal
