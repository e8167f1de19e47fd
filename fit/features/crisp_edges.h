// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/features/feature_curves.h"
#include "subvol/surface/triangle_mesh.h"

#include <optional>
#include <string>

namespace subvol::internal {

/// How much the sharp edges of a surface stand out from what is around them.
struct EdgeCrispness {
  /// Share of the curves' length along which no other edge of the two triangles bends by more than a third of the
  /// edge's own angle; edges that belong to curves do not count as others. 0 without curves.
  double crisp_share = 0;
  /// Length of the curves that are crisp along most of their length and longer than 3 % of the diagonal of their
  /// connected part, divided by the square root of the surface's area.
  double relative_length = 0;
  /// Share of the curves' length that bounds a plane: several triangles in one plane, with an area of more than 0.01 %
  /// of the diagonal's square.
  double planar_share = 0;
  /// That length, divided by the square root of the surface's area.
  double relative_planar_length = 0;

  /// True for parts as they are designed, whose edges must stay. The bends of scans and sculptures exceed any angle in
  /// places, but their surroundings bend nearly as much, and are not planar; parts with many rounded edges have much
  /// longer crisp ones, and edges at planes. Figures of 184 surfaces:
  ///
  /// - Scans have a crisp share of less than 0.5, a relative length of less than 1, or at most 0.95 in the first sum.
  ///   One has 1.01, because of the rim of a covered hole, and two coarse meshes of animals have more. They have at
  ///   most 1.24 in the second sum.
  /// - Parts have at least 0.51, 2.0 and 1.07, or 1.56 in the second sum.
  bool is_designed() const {
    // Relative length that counts as much as a crisp share of 1, and the factor on the planar share.
    constexpr double kFullCrispLength = 15, kPlanarShareFactor = 2;
    constexpr double kLeastSum = 1.04, kLeastSumOfPlanes = 1.4;
    constexpr double kLeastPlanarLength = 0.3;  // more than the rim of a hole that was covered in a scan
    const double crisp = crisp_share + relative_length / kFullCrispLength;
    return (crisp_share >= 0.5 && relative_length >= 1 && crisp >= kLeastSum) ||
           (relative_planar_length >= kLeastPlanarLength &&
            crisp + kPlanarShareFactor * planar_share >= kLeastSumOfPlanes);
  }
};

/// mesh, curves  as for and from `feature_curves`. Cost: one sort of the edges and one of the triangles.
EdgeCrispness edge_crispness(const TriangleMesh& mesh, const FeatureCurves& curves);

/// Says what a fit does about the sharp edges of a surface.
struct EdgeDecision {
  bool follows = false;  ///< there are some, and they are a designed part's or all are to be followed
  std::string warning;   ///< if edges are left out that stand out: what they are, and how they are followed; else empty
};

/// angle_degrees  as for `feature_curves`; nothing: no edge is sharp.
EdgeDecision decide_about_edges(const TriangleMesh& mesh, std::optional<double> angle_degrees, bool follows_all_edges);
/// As above, without the warning.
bool has_edges_to_follow(const TriangleMesh& mesh, std::optional<double> angle_degrees, bool follows_all_edges);

}  // namespace subvol::internal
