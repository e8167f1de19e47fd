// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/subdivision/boundary_rule.h"

#include <array>
#include <span>

namespace subvol::internal {

/// Returns the sharpness after one refinement: s - 1, but not below 0; values >= kInfiniteSharpness stay as they are.
///
/// All of it is in single precision, as in OpenSubdiv, so that fractions blend to the same weights.
float child_sharpness(float sharpness);

/// Weights of the child of a boundary edge with ends v0, v1 between faces with centroids F0, F1:
///
///   child = end (v0 + v1) + face[0] F0 + face[1] F1
struct EdgeWeights {
  double end;
  std::array<double, 2> face;
};

/// sharpness  of the edge, >= 0: from 1 on a crease, below 1 a blend of the crease and smooth rules.
/// sizes      numbers of corners of the two faces, >= 3.
EdgeWeights edge_weights(BoundaryRule rule, float sharpness, std::array<int, 2> sizes);

/// Weights of the child of a boundary vertex v with neighbors e_i along edges and faces with centroids F_i:
///
///   child = self v + sum_i (edge e_i + face F_i) + crease (e_a + e_b),   a = crease_ends[0], b = crease_ends[1]
struct VertexWeights {
  double self, edge, face, crease;
  std::array<int, 2> crease_ends;  ///< numbers of edges; meaningful only if crease != 0
  bool fixed() const { return self == 1.0; }
};

/// corner_sharpness  of the vertex, >= 0.
/// edge_sharpness    of its edges in the order of its ring, >= 0.
///
/// A sharp vertex and one with more than two sharp edges are fixed. With two sharp edges the rule is (1 6 1)/8 along
/// them; with one (a dart) or none it is smooth. If the rule changes because sharpnesses reach 0 in this step, the
/// rules before and after are blended; the weight of the first is the mean of those sharpnesses, at most 1.
VertexWeights vertex_weights(BoundaryRule rule, float corner_sharpness, std::span<const float> edge_sharpness);

}  // namespace subvol::internal
