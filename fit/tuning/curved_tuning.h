// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace subvol {

/// Numbers of fits of curved elements that were tuned, for experiments: docs/curved-elements.md, "The numbers in the
/// code". Percentages are of the diagonal of the target's bounding box.
struct CurvedTuning {
  /// Share of the target's sharp edges, by length, that creases must follow for the lower of the two usual lambdas:
  /// soft cells are pressed flat where the surface is drawn into an edge that they do not follow. Of a wedge of 15
  /// degrees whose tip is not followed, they kept a least scaled Jacobian of 0.02 instead of 0.73.
  double nearly_all_edges = 0.98;
  double stiff_lambda = 1;  ///< lambda of a stiff approach: 20 times that of other stages
  int stiff_order = 4;      ///< order from which on a stiff approach lowers lambda
  /// Steps of a stiff stage, which only leads the way: after this many, the next stage makes faster progress.
  int stiff_steps = 10;
  int most_steps = 40;  ///< of any other stage; most end earlier
  /// For a far template, another attempt is made at the first orders if the boundary is folded, or if the mean distance
  /// exceeds this percentage and E_W exceeds the other number: the cells are distorted and still far from the target,
  /// so their resolution is not the cause.
  double fair_distance_percent = 0.12, fair_distortion = 0.3;
  /// Intervals of the samples along an edge of a face: the most, the fewest for each order, and as many as are wanted.
  int most_intervals = 16, least_intervals_per_order = 2, wanted_intervals_per_order = 4;
  int most_fitted_triangles = 60000;  ///< beyond so many triangles of all faces, edges get no more than they need
  /// Cells that block a step: the most quadrature points per direction (more cost more than they gain), the first
  /// emphasis k, which is then doubled, and the scaled Jacobian from which on a point gets none.
  int most_points_per_direction = 25;
  double first_emphasis = 4, fair_shape = 0.6;
  /// Factor on the stiffness of points that block a step, and the largest number of times that one step may stiffen
  /// them.
  double stiffening_factor = 10;
  int most_stiffenings = 5;
  /// A place is far if its distance exceeds this many times the mean and this percentage, a tenth of the largest
  /// distance that automatic fits aim at: on flat faces, the mean can be so small that it is no measure.
  double far_share = 8, near_percent = 0.05;
  int most_draws = 4, draw_steps = 20;  ///< draws toward the target in a round, and the steps of each
  int most_improvements = 3;            ///< rounds of both improvements, of far places and of poor cells
  double most_distance_growth = 1.2;    ///< factor by which all improvements may raise the distances
  /// Largest distance that may be caused in any case, as a percentage: what automatic fits aim at.
  double allowed_max_percent = 0.5;
  int lift_steps = 8;  ///< of the minimization with one value of a lift
  /// The threshold of the hinge is the quality aimed at plus this. At order 4, a bone of 87 hexes came to a least
  /// scaled Jacobian of 0.66 with 0.05, and to 0.76 with 0.2; a double torus gained nothing with 0.35.
  double hinge_above_quality = 0.2;
  /// Values in a row without a gain that end a lift: the next one may still help after one or two that do not.
  int most_failed_lifts = 3;
  int most_moved_as_whole = 3000;    ///< cells up to which all are moved: that takes seconds, and helps more
  double most_unfolding_lambda = 1;  ///< the largest lambda that is attempted if the boundary intersects itself
  /// Adaptive orders: share of the total possible gain that one raise aims at, and the least gain, relative to E_S,
  /// that justifies a raise.
  double raised_share = 0.7, least_order_gain = 0.02;
};

}  // namespace subvol
