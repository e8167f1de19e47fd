// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace subvol {

/// Numbers of automatic fits that were tuned, for experiments: docs/automatic-fits.md, "The numbers in the code".
struct AutomaticTuning {
  /// No other template is tried below this merit: 95 % of the edges are followed within 0.1 %, if nothing else is
  /// missed.
  double good_merit = 0.15;
  double quality_weight = 5;  ///< of the share of the quality in the merit
  /// Cost of a boundary that meets itself, and of cells that are not certified: so much that a valid trial wins,
  /// however many edges an invalid one follows.
  double not_valid = 10;
  /// Cost of long edges that are not followed, of a feature that is lost, and of a solid of another volume: such a
  /// trial is far off, so that it is never good, is worth a refinement, and is chosen only if its cells are better by
  /// more than 0.3 of the quality aimed at. (At 0.6, parts ended with status 4 for 0.03 of the scaled Jacobian.)
  double far_off = 1.5;
  double edge_weight = 3;  ///< of the share of edges that are not followed closely
  double most_miss = 3;    ///< the most that each other miss counts
  /// No other template is tried either if the quality is what keeps a trial from being good, and reaches this share of
  /// the goal: larger templates have the same angles at sharp edges and irregular vertices.
  double enough_quality = 0.85;
  /// Scaled Jacobian below which a cell is poor even at an acute corner, where less than the goal is asked for: edges
  /// of the target are given up for it.
  double acceptable_quality = 0.3;
  /// Share of the area on planes from which on grids that are not through them are worse.
  double most_aligned_share = 0.4;
  double room_for_pads = 0.5;  ///< share of the cells allowed that a grid is first asked for, since pads add cells
  double least_routed_share =
      0.8;                ///< share of the edges that must find a path, or a finer grid is worth more than a fit
  int most_routings = 5;  ///< of one grid; each gives up edges at which the one before left poor cells
  /// Long edges that the first grid may lose. Of five parts that lost more, no other grid lost none.
  int most_long_lost = 2;
  /// One in so many of the curves at fault is given up at once: a smaller share takes many more fits, a larger one
  /// gives up curves that are well without the others.
  int one_in = 3;
  double most_refinement_growth = 1.5;  ///< factor on the number of cells, by cutting some of them
  int most_relaxation_rounds = 12;
  double first_surface_weight = 10;     ///< of the first round of a relaxation; it falls from round to round
  double polish_quality_step = 0.05;    ///< rise of the least scaled Jacobian asked for, from one lift to the next
  double polish_distance_growth = 1.2;  ///< factor on the largest distance that a polish may cause
  /// If more than this share of the cells is below a quality, lifting them moves most of the mesh. A vertex of a cage
  /// moves more cells.
  double most_poor = 0.1, most_poor_of_cage = 0.05;
};

}  // namespace subvol
