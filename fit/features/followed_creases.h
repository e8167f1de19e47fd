// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/features/crease_distance.h"
#include "fit/features/crease_energy.h"
#include "fit/features/crease_paths.h"
#include "subvol/mesh/volume_mesh.h"
#include "subvol/subdivision/limit_surface.h"
#include "subvol/surface/triangle_mesh.h"

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace subvol {

/// Edges sharper than this, in degrees, are features where nobody says otherwise.
inline constexpr double kUsualCreaseAngle = 40;
/// A crease counts as much as a strip of surface so wide, by the target's length V/A.
inline constexpr double kCreaseWidth = 1;

/// The creases of a fit from level to level, and which feature curve of the target each of them follows.
class FollowedCreases {
 public:
  /// No creases that follow anything.
  FollowedCreases() = default;

  /// With an angle: tags a template by the target's edges that are sharper, with creases along the paths that follow
  /// them (`follow_curves`) and what keeps the boundary from folding at their corners (`unfolding_tags`); tags it has
  /// already stay. Without: finds out which of the template's own creases follow edges sharper than kUsualCreaseAngle.
  /// tagged: edges of the target that are sharp whatever their angle.
  FollowedCreases(const TriangleMesh& target, std::optional<double> angle_degrees, VolumeMesh& template_mesh,
                  std::span<const std::array<Index, 2>> tagged = {});

  const FeatureCurves& curves() const { return curves_; }
  /// Whether most of the target's sharp edges, by length, are followed: creases then hold the surface in its place.
  bool hold_the_surface() const;

  /// Gives up the curves that have a crease at one of the vertices marked, with their tags and the corners marked.
  void release(std::span<const std::uint8_t> vertices, VolumeMesh& mesh);

  /// Goes over to the creases of a mesh refined from the present one; parents: for each, the crease that it came from.
  void refine(std::span<const Index> parents);

  /// Draws the samples on the creases to their curves: `edges` between samples run along the mesh's creases in their
  /// order, equally many for each.
  CreaseEnergy energy(std::span<const std::array<Index, 2>> edges, std::size_t num_samples, double width,
                      double tangential_weight) const;
  /// limit  refinement of the present level's mesh, at `points`.
  CreaseDistance distance(const BoundaryRefinement& limit, std::span<const Vec3> points, double diagonal) const;

 private:
  void tag(VolumeMesh& template_mesh) const;
  std::vector<CreaseSegment> segments(std::span<const std::array<Index, 2>> edges) const;

  FeatureCurves curves_;
  std::vector<CreasePath> paths_;
  std::vector<Index> curve_of_crease_;  ///< in the order of the mesh's tags; kNoIndex for creases that follow nothing
};

}  // namespace subvol
