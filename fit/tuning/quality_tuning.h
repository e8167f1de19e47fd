// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace subvol {

/// Numbers of the quality energy and of lifts that were tuned, for experiments: docs/quality.md, "The numbers in the
/// code". Percentages are of the diagonal of the target's bounding box.
struct QualityTuning {
  double inner_weight = 1.0 / 16;  ///< a_q of points that are no corners
  /// Least length of a direction, as a share of the cell's size h_i, which bounds the energy's derivatives. A folded
  /// cell had a direction of length 1e-7 at a point; its Hessian was 1e13 times that of other cells, and no vertex of
  /// the patch around it moved.
  double least_length = 0.05;
  /// Factors on the emphasis of a cell that is below its goal, or above it, and the largest emphasis. It rises within a
  /// few rounds and falls slowly, so that a cell which has just reached its goal stays there.
  double emphasis_rise = 2.5, emphasis_fall = 0.97, most_emphasis = 1000;
  /// Goals at caps are lower than the caps by the first number, but at least the second: caps are 0 where edges are
  /// flat.
  double below_cap = 0.02, least_goal = 0.01;
  double reachable_share = 0.93;  ///< share of the best possible scaled Jacobian that is asked for at sharp edges
  double corner_cap = 0.8;        ///< cap at corners of several cells; with 0.55 a pyramid got 0.53, with this 0.66
  double least_fold_limit = 300;  ///< degrees: least limit of the angle of folds of the boundary
  double first_damping = 1e-3;    ///< damping mu with which the Levenberg-Marquardt method begins
  /// Least mu, relative to the diagonal of the Hessian, where it has hardly any effect; factors on mu after a step that
  /// was taken at once, and after one that was not.
  double least_damping = 1e-4, damping_fall = 0.3, damping_rise = 6;
  double tangential_weight = 0.02;  ///< share of the pull along the target's tangents and creases
  double crease_edges = 5;          ///< width, in edges, of the strip of surface that counts as much as a crease
  /// The threshold of the hinge lies this far above the goal: a squared hinge is not zero where it balances the
  /// surface.
  double hinge_margin = 0.15;
  /// A coarse mesh needs no more than this below the goal: refining raises the mean, and the lift of the fine mesh the
  /// least scaled Jacobian.
  double coarse_margin = 0.05;
  int most_coarse_lift_steps = 20, most_fine_lift_steps = 40;  ///< of the lift of a whole mesh
  int lift_round_steps = 2,
      lift_patience = 5;  ///< steps of a round of a lift; rounds without a better state that end it
  /// Share of the poor cells; a round of the whole mesh must leave fewer than that.
  double most_poor_share_left = 0.7;
  double most_patch_share = 0.4;  ///< share of all cells up to which patches cost less than the whole mesh
  /// Share of the largest distance from which on places count as far, in lifts that start from a mesh whose surface is
  /// where it should be.
  double late_far_margin = 0.9;
  /// The lift aims at this share of the largest distance allowed: it measures at samples, which miss the farthest
  /// places.
  double max_margin = 0.8;
  double enough_of_goal = 0.75;     ///< a gain to this share of the quality aimed at ends the attempts of a fit
  double poor_share = 0.5;          ///< the surface is drawn back only if the quality was below this share
  int later_lift_steps = 20;        ///< of the lift when the surface is drawn back: the cells have been lifted before
  int attempts_before_freeing = 2;  ///< attempts that are made if the mesh may be freed from the cage afterwards
  double layer_below = 0.75;        ///< freed meshes: share of the quality below which a layer of cells is attempted
  double most_rise = 1.05;          ///< freed meshes: largest factor on the distances from the target
  /// Freed meshes: share of the distances of the cage's mesh that is the tolerance of a second optimization, if the
  /// first result is farther off than that mesh may be.
  double nearer_share = 0.7;
  /// Freed meshes: mean distance, in sizes of a boundary face, at which one counts as the finest level that its cage
  /// could not reach. Balls and tori of 50 to 4,000 cells have 0.02 to 0.08.
  double reached_share = 0.1;
  /// Distances may rise by 5 %, but not past the tolerance; those of the surface that is nearer by a quarter. It gives
  /// way first, because the stages before put it as near as they could. If no mean rises, largest distances may rise by
  /// 10 %: so joint129 at level 2 rises from 0.08 to 0.62 while its mean distance falls by 2 % and its largest one, at
  /// a single place, rises by 7 %.
  double most_distance_factor = 1.05, most_nearer_distance_factor = 1.25, most_farthest_place_factor = 1.1;
};

}  // namespace subvol
