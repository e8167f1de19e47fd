// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/features/crease_distance.h"
#include "subvol/fit/features/crease_energy.h"
#include "subvol/fit/features/crease_paths.h"
#include "subvol/mesh/volume_mesh.h"
#include "subvol/surface/triangle_mesh.h"

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace subvol::internal {

/// Width of the strip of surface that counts as much as a crease, in units of the target's length V/A.
inline constexpr double kCreaseWidth = 1;

/// The creases of a fit from level to level, and the feature curve of the target that each of them follows.
class FollowedCreases {
 public:
  /// Creases none of which follows a curve.
  FollowedCreases() = default;

  /// With an angle: finds the target's edges that are sharper, and tags a template with creases along the paths that
  /// follow them (`follow_curves`) and with tags that keep the boundary from folding at their corners
  /// (`unfolding_tags`); existing tags are kept. Without: finds the template's own creases that follow edges sharper
  /// than kUsualCreaseAngle. tagged: edges of the target that are sharp whatever their angle.
  FollowedCreases(const TriangleMesh& target, std::optional<double> angle_degrees, VolumeMesh& template_mesh,
                  std::span<const std::array<Index, 2>> tagged = {});

  /// With paths that are known: tags the mesh along them, with no other tags.
  FollowedCreases(FeatureCurves curves, std::vector<CreasePath> paths, VolumeMesh& mesh);

  /// Adds tags to the mesh that was tagged that keep its subdivision surface from folding (`unfolding_tags`).
  void keep_from_folding(VolumeMesh& mesh);

  /// Says what the sharp edges of interfaces are drawn to.
  enum class InnerCurves {
    nothing,              ///< the sheets alone draw them: the target has interfaces of its own
    themselves,           ///< the edges as they are
    themselves_with_rims  ///< likewise, and the curves where interfaces end at the boundary, if that stays where it is
  };

  /// Tags a mesh with the sharp edges of the interfaces between its regions: edges sharper than the angle, creases of
  /// its tags, and inner feature curves. Also adds tags that keep interfaces from folding at their corners
  /// (`unfolding_tags`).
  void keep_interfaces(VolumeMesh& mesh, double angle_degrees, InnerCurves drawn_to);

  const FeatureCurves& curves() const { return curves_; }
  /// Returns the share of the length of the target's sharp edges that is followed; 0 if there are none.
  double followed_share() const;
  /// True if most of this length is followed: creases then hold the surface in its place.
  bool hold_the_surface() const;

  /// Removes all creases of curves that have a crease at a marked vertex, all other creases there, and marked corners.
  void release(std::span<const std::uint8_t> vertices, VolumeMesh& mesh);

  /// Switches to the creases of a refinement of the present mesh; parents: for each of them, the crease it came from.
  void refine(std::span<const Index> parents);

  /// Returns the energy that draws the samples on creases to their curves. `edges` between samples run along the mesh's
  /// creases in the order of the creases, equally many for each.
  CreaseEnergy energy(std::span<const std::array<Index, 2>> edges, std::size_t num_samples, double width,
                      double tangential_weight) const;
  /// Measures the distances of the creases. `edges` between points run along them as for `energy`.
  /// whole  the curves that `curves` are parts of; null: themselves.
  CreaseDistance distance(std::span<const std::array<Index, 2>> edges, std::span<const Vec3> points, double diagonal,
                          const FeatureCurves* whole = nullptr) const;

 private:
  void tag(VolumeMesh& template_mesh) const;
  void find_curves_of_creases(const VolumeMesh& mesh);
  std::vector<CreaseSegment> segments(std::span<const std::array<Index, 2>> edges) const;

  FeatureCurves curves_;
  std::vector<CreasePath> paths_;
  std::vector<Index> curve_of_crease_;  ///< in the order of the mesh's tags; kNoIndex for creases that follow nothing
};

}  // namespace subvol::internal
