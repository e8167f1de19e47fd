// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/features/pads.h"
#include "subvol/fit/features/signed_features.h"
#include "subvol/fit/tuning/quality_tuning.h"

#include <array>
#include <vector>

namespace subvol::internal {

/// Bound on the scaled Jacobian at both ends of an edge, in the cells around it.
struct EdgeCap {
  std::array<Index, 2> ends;  ///< the smaller number first
  double cap;                 ///< in [0, 1)
  double angle = 0;           ///< interior angle that is wanted there, in degrees
};

/// Bound on the scaled Jacobian at a vertex, in all its cells.
struct VertexCap {
  Index vertex;
  double cap;  ///< in [0, 1)
};

/// The scaled Jacobians that sharp edges and corners of the target allow. Asking for more there would move the surface
/// away from the target.
struct QualityCaps {
  std::vector<EdgeCap> edges;       ///< of all edges of paths, ascending by their ends
  std::vector<VertexCap> vertices;  ///< of the corners of three paths or more, ascending
};

/// Computes the bounds.
///
///   edge    0.93 sin(theta / k),  theta: mean interior angle along its curve;  k: number of cells around it
///   corner  0.93 |det(t_1, t_2, t_3)| if it belongs to one cell, t_i: unit directions of its curves;  0.8 otherwise
///
/// 0.93 and 0.8 are defaults of `QualityTuning`. 0.93 leaves room for neighbors that are not perfect; sin(theta / k) is
/// that of equal parts, and falls to 0 for parts of 180 degrees or more. Where the angle is smaller than its curve's
/// mean, the surface does give way a little: with the angle at each edge, cells at one curve of i10 fell from a scaled
/// Jacobian of 0.61 to 0.32.
/// features  those that were routed. InputError: a path along something that is not an edge of the mesh, or of a curve
/// that does not exist. Cost: one pass over the mesh.
QualityCaps quality_caps(const PatchedMesh& patched, const SignedFeatures& features, const QualityTuning& tuning = {});

}  // namespace subvol::internal
