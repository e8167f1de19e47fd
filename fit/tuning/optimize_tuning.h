// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace subvol {

/// Numbers of the optimization of meshes that were tuned, for experiments: docs/optimize.md, "The numbers in the code".
struct OptimizeTuning {
  double far_distance = 0.002;    ///< correspondences of this length, as a share of the diagonal, count twice
  double poor_jacobian = 0.2;     ///< cells with a lower scaled Jacobian may move corners of sharp edges, at first
  double trusted_jacobian = 0.3;  ///< scaled Jacobian from which on a cell indicates its wanted size
  double least_relief = 0.25;  ///< least factor to which the weight of a cell is lowered for the sake of the distance
  double told_volume_change = 1e-4;  ///< largest relative change of a volume for which there is no warning
  double most_volume_change = 1e-3;  ///< largest relative change of a region's volume at which interfaces may slide
  /// Epsilon is this share of the worst determinant: the barrier then reaches every inverted cell and falls as fast as
  /// the cells recover (the rule of the published code). After a round that gains little, the next epsilon is at most
  /// the last one times the second number.
  double share_of_worst = 0.2, least_fall = 0.5;
  double converged_decrease = 0.1;  ///< relative decrease of the energy below which a round of untangling has converged
  /// Distances are kept below these shares of the tolerances, since they are measured at samples, which miss the
  /// farthest places.
  double mean_share_of_tolerance = 0.9, max_share_of_tolerance = 0.8;
  /// Ideal boxes and weights change after a round: more steps toward those of before are lost.
  int first_round_steps = 4, round_steps = 2, most_rounds = 14;
  double more_surface = 10;         ///< factor on the weight of the surface in the second attempt
  double quality_beyond_aim = 0.1;  ///< scaled Jacobian that is asked for beyond the aim, once that is reached
};

}  // namespace subvol
