// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/features/feature_curves.h"
#include "subvol/mesh/volume_mesh.h"

#include <vector>

namespace subvol::internal {

/// A path of boundary edges of a volume mesh that follows a feature curve of the target.
struct CreasePath {
  Index curve;                  ///< index into FeatureCurves::curves
  std::vector<Index> vertices;  ///< in the curve's direction; closed (first vertex repeated) if the curve is
};

enum class PathEdges { all, creases /**< those in the mesh's tags */ };

/// Finds a path in a template's boundary for each feature curve of the target, if there is one.
///
/// Corners of the target are assigned to the nearest boundary vertices, the nearest pair first, one to one. The path
/// between them minimizes
///
///   integral of (d^2 + epsilon^2) ds,   d: distance to the curve, epsilon: a small share of the mean edge length
///
/// and shares no edge, and no vertex but its ends, with a path found before; the paths that fit best come first. A path
/// is accepted if it and the curve stay within three quarters of the path's mean edge length of one another. Closed
/// curves without a corner start at the vertex nearest to them; where a feature runs out, its path may end at any
/// vertex nearby.
///
/// mesh      passes `validate` except for `unused_vertex`, and lies roughly where the target is.
/// through   the boundary edges that paths may use.
/// returns   at most one path per curve, ascending by curve. Deterministic.
/// Cost: some shortest-path searches over the boundary's edges near the curve, for each curve that is not much shorter
/// than an edge.
std::vector<CreasePath> follow_curves(const VolumeMesh& mesh, const FeatureCurves& curves,
                                      PathEdges through = PathEdges::all);

/// Returns infinitely sharp tags: creases along the paths, and corners where two or more paths meet at a corner of the
/// target.
FeatureTags tags_of_paths(const std::vector<CreasePath>& paths, const FeatureCurves& curves);

}  // namespace subvol::internal
