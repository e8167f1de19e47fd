// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace subvol {

/// Numbers of fits with a template that were tuned, for experiments: docs/fitting.md, "The numbers in the code".
/// Percentages are of the diagonal of the target's bounding box.
struct FitTuning {
  double coarse_lambda =
      0.05;  ///< lambda on coarse levels: stiff cells round the template before it reaches the target
  /// Lambda if creases are drawn to the target from the start: stiffer cells swell beside the creases, and the folds
  /// that this makes do not disappear later.
  double held_lambda = 0.01;
  /// Weights of tangential distances, as shares of that of normal ones, far from the target and close to it.
  double far_tangential_weight = 0.1, close_tangential_weight = 0.003;
  /// Initial mean distance, in V/A, below which the template's own cells indicate the shape of the fitted cells.
  double close_distance = 0.4;
  double unfolding_factor = 4;         ///< on lambda if the boundary intersects itself
  double most_unfolding_lambda = 0.1;  ///< the largest lambda that is attempted for that reason
  /// A fit without a tolerance lowers lambda further until the mean distance is below this percentage.
  double default_accuracy_percent = 0.015;
  /// Least lambda, as a share of `FitOptions::lambda_close`, without and with a tolerance.
  double least_default_lambda_share = 1.0 / 16, least_lambda_share = 1e-3;
  /// Lambda is not lowered any further if a stage reduces the mean distance by less than this share.
  double least_lambda_halving_gain = 0.01;
  /// Without a tolerance, the largest total decrease of the mean scaled Jacobian that lowering lambda may cause.
  double most_shape_loss = 0.0075;
  /// The corresponding limit for cage-only fits, in which few degrees of freedom have to reach the whole surface.
  double most_cage_shape_loss = 0.015;
  /// Relative decrease of the energy in a step at which a stage of accelerated steps ends. Accelerated steps decrease
  /// the energy by more, so it is then what it is at the end of many more plain steps.
  double accelerated_decrease = 5e-3;
  /// Stages that take many steps solve their systems roughly, to this relative residual, and keep the cells' Hessian
  /// for several steps, which makes a step cheaper. A continuation does neither: its few steps must free every cell.
  double rough_tolerance = 0.3;
  int hessian_life = 4;
  /// Position of the finest level's samples between the limit surface (0) and the mesh (1).
  double mesh_share = 0.3;
  /// Largest mean gap between the two, as a share of the diagonal, for which the mesh is considered. A coarser mesh
  /// cannot follow the target anyway and would only draw the limit surface away from it.
  double most_mesh_limit_gap = 5e-4;
  /// Samples of the target below the finest level: for each quad of the boundary, and at least.
  int samples_per_quad = 6, least_coarse_samples = 3000;
  /// Samples of the target for each sample of the fitted surface: on coarse levels, and from which on the finest level
  /// has fewer than the target offers.
  int most_per_sample = 4, far_too_many_per_sample = 8;
  int least_target_samples = 20000;  ///< approximate least number of samples of a target
  /// Continuation: factor on the gain of t until a step is feasible, the least gain that counts, and the share of the
  /// rest below which the gain is slow, so that lambda rises.
  double back_off = 0.6, least_progress = 1e-3, slow_share = 0.25;
};

}  // namespace subvol
