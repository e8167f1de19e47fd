// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/geometry/closest_point.h"
#include "fit/geometry/surface_distance.h"
#include "fit/target/target_report.h"
#include "fit/target/target_surface.h"
#include "subvol/mesh/volume_mesh.h"

#include <cstddef>
#include <optional>
#include <vector>

namespace subvol {

/// Centred coordinates in which the target's box has the diagonal 1: nothing depends on the origin or the unit.
struct Normalisation {
  Vec3 centre = Vec3::Zero();
  double diagonal = 1;

  /// InputError: a target without extent, or with coordinates that are not finite.
  explicit Normalisation(const TriangleMesh& target);
  explicit Normalisation(const PointCloud& target);
  std::vector<Vec3> to_unit(std::vector<Vec3> points) const;
  /// Moves a mesh to these coordinates. InputError: its cells are next to nothing beside the target, or the target is
  /// beside them, or is as far away.
  void take_in(VolumeMesh& mesh) const;
  std::vector<Vec3> from_unit(std::vector<Vec3> points) const;
};

/// The target is sampled at least about so many times.
inline constexpr std::size_t kLeastTargetSamples = 20000;

/// What a fit is to reproduce, in normalised coordinates: lengths are shares of the target's diagonal.
struct FitTarget {
  Normalisation normalisation;
  TriangleMesh mesh;                 ///< no triangles: a cloud is fitted
  std::optional<ClosestPoint> tree;  ///< of its triangles
  TargetSurface surface;             ///< its samples are those of the last `sample`

  /// InputError: as Normalisation.
  explicit FitTarget(const TriangleMesh& target);
  explicit FitTarget(const PointCloud& target, PointWeights weights = PointWeights::equal);

  /// Samples the surface about as densely as the fitted one: sparse sites on large facets would claim points of the
  /// surface that belong to a neighbouring facet. A cloud keeps its points.
  /// least  samples that are taken in any case (triangles have one each at least).
  void sample(std::size_t num_samples, std::size_t least = kLeastTargetSamples);

  /// Symmetric distances to another surface; of a cloud, those of its points to the surface.
  SurfaceDistance distance(const TriangleMesh& fitted) const { return measure(fitted, true); }
  double mean_distance(const TriangleMesh& fitted) const { return measure(fitted, false).mean(); }

  /// Measures how far a template's boundary is, and describes the state of the target. If the target encloses nothing,
  /// the boundary's volume is taken for the one wanted.
  StartComparison compare_start(const TriangleMesh& boundary);

 private:
  SurfaceDistance measure(const TriangleMesh& fitted, bool extremes) const;
};

}  // namespace subvol
