// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/closest_point.h"
#include "fit/fit_report.h"
#include "fit/fit_schedule.h"
#include "fit/target_surface.h"

namespace subvol {

/// Centred coordinates in which the target's box has the diagonal 1: nothing depends on the origin or the unit.
struct Normalisation {
  Vec3 centre = Vec3::Zero();
  double diagonal = 1;

  /// InputError: a target without extent, or with coordinates that are not finite.
  explicit Normalisation(const TriangleMesh& target);
  std::vector<Vec3> to_unit(std::vector<Vec3> points) const;
  std::vector<Vec3> from_unit(std::vector<Vec3> points) const;
};

/// What a fit is to reproduce, in normalised coordinates: lengths are shares of the target's diagonal.
struct FitTarget {
  Normalisation normalisation;
  TriangleMesh mesh;
  ClosestPoint tree;
  TargetSurface surface;  ///< its samples are those of the last `sample`

  /// InputError: as Normalisation.
  explicit FitTarget(const TriangleMesh& target);

  /// Samples the surface about as densely as the fitted one: sparse sites on large facets would claim points of the
  /// surface that belong to a neighbouring facet.
  /// least  samples that are taken in any case (triangles have one each at least).
  void sample(std::size_t num_samples, std::size_t least = kLeastTargetSamples);

  /// Mean symmetric distance to another surface.
  double mean_distance(const TriangleMesh& fitted) const;

  /// Notes how far a template's boundary is, and what no fit of it can change. Returns the mean distance.
  double compare_start(const TriangleMesh& boundary, FitReport& report) const;
};

}  // namespace subvol
