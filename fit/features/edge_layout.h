// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/features/curve_choice.h"
#include "subvol/fit/features/feature_routing.h"
#include "subvol/fit/features/followed_creases.h"
#include "subvol/fit/features/pads.h"
#include "subvol/fit/features/quality_caps.h"
#include "subvol/fit/features/signed_features.h"
#include "subvol/mesh/volume_mesh.h"
#include "subvol/surface/triangle_mesh.h"

#include <span>
#include <vector>

namespace subvol::internal {

/// A grid prepared to follow the sharp edges of a target: routed, divided into patches and padded.
struct EdgeLayout {
  FeatureRouting routing;
  PatchedMesh patched;  ///< its mesh is the one to fit, from its positions; without tags
  PadReport pads;       ///< those of narrow strips are the last
  QualityCaps caps;
  FollowedCreases creases;               ///< of the patched mesh
  std::vector<CreaseSegment> segments;   ///< edges of the paths, and the curves of `creases` that they follow
  std::vector<Index> group_of_face;      ///< of each face of the mesh, by `MeshTopology`; 0 for faces inside
  std::vector<Index> group_of_triangle;  ///< of each triangle of the target

  /// The mesh with tags on the edges of the paths.
  VolumeMesh tagged_mesh;
};

/// Routes the features (`route_features`), divides the boundary (`patched_mesh`), pads it (`add_pads`), follows curves
/// that are closer to others than a cell (`follow_narrow_strips`), and prepares what a fit needs. A curve that could be
/// followed like that as a whole loses its parts; if it is lost then, all but the routing is done again with them.
///
/// grid     hexes; passes `validate` except for unused vertices.
/// fitted   positions of its vertices near the target.
/// target   oriented outward, in the coordinates of the fitted positions; features: its own.
/// InputError: as the functions named.
EdgeLayout edge_layout(const VolumeMesh& grid, std::span<const Vec3> fitted, const TriangleMesh& target,
                       const SignedFeatures& features, const RoutingOptions& options, const QualityTuning& tuning = {});

}  // namespace subvol::internal
