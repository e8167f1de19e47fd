// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"

#include <vector>

namespace subvol {

/// Sharpness at and above which a crease or corner never softens (OpenSubdiv's convention).
inline constexpr double kInfiniteSharpness = 10.0;

/// An edge of the boundary, or of an interface between regions, kept sharp through `sharpness` refinements (fractions
/// blend; >= kInfiniteSharpness: forever).
struct CreaseEdge {
  Index v0, v1;  ///< v0 < v1
  double sharpness = kInfiniteSharpness;
  friend bool operator==(const CreaseEdge&, const CreaseEdge&) = default;
};

/// A vertex of one of these kept in its place through `sharpness` refinements (likewise).
struct CornerVertex {
  Index vertex;
  double sharpness = kInfiniteSharpness;
  friend bool operator==(const CornerVertex&, const CornerVertex&) = default;
};

/// Features of a mesh's boundary and of its interfaces. Every edge and vertex occurs at most once; both lists are
/// sorted; sharpness > 0.
struct FeatureTags {
  std::vector<CreaseEdge> creases;
  std::vector<CornerVertex> corners;
  bool empty() const { return creases.empty() && corners.empty(); }
  friend bool operator==(const FeatureTags&, const FeatureTags&) = default;
};

}  // namespace subvol
