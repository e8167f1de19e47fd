// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/stages/fit_options.h"
#include "fit/stages/stage.h"

#include <vector>

namespace subvol {

/// Mean distance, in per cent of the diagonal, down to which a fit without a tolerance lowers lambda further.
inline constexpr double kDefaultAccuracyPercent = 0.015;
/// How far below `FitOptions::lambda_close` lambda may go for that, and for a tolerance that was asked for.
inline constexpr double kLeastDefaultLambdaShare = 1.0 / 16, kLeastLambdaShare = 1e-3;
/// Where a fit's boundary intersects itself, lambda is raised up to this.
inline constexpr double kMostUnfoldingLambda = 0.1;
/// Lowering lambda ends when a stage takes less than this share off the mean distance.
inline constexpr double kLeastGain = 0.01;
/// Without a tolerance, halvings of lambda may cost so much of the mean scaled Jacobian in all.
inline constexpr double kMostShapeLoss = 0.0075;
/// The same where only the template's vertices move: few unknowns have to reach the whole surface.
inline constexpr double kMostCageShapeLoss = 0.015;

/// Which minimisations a recursive fit runs, decided from the template's initial distance.
///
/// A stiff start (lambda > 0.05) shrinks and rounds the template and loses features that never come back, so it is kept
/// for templates that are really far.
struct FitSchedule {
  /// How much level 1 takes the template cells' own boxes for ideal (`ideal_boxes`); each further entry is another try,
  /// for templates that cannot be refined without inverting a cell with those before.
  std::vector<double> own_box_shares;
  int levels = 0;
  std::vector<Stage> first, middle, last;  ///< of level 1, of the levels between, of the finest
  Stage continuation;

  std::vector<Stage> stages(int number) const;
  /// The last stage with another lambda.
  Stage final_stage(double lambda) const;
  /// Quadrature points per direction: nested from level to level, so that no child starts inverted at one of its
  /// points.
  int quadrature_points(int number) const { return number == 1 ? 5 : number == 2 ? 3 : 2; }
  /// Rough share of the work that is done when a level begins.
  double fraction(int number) const;
};

/// How much the cells' own boxes are taken for ideal at first, by the template's distance: first choice first.
std::vector<double> own_box_shares(double distance);

/// distance      mean distance of template and target by the target's length V/A.
/// creases_hold  whether creases are tied to most of the target's sharp edges.
FitSchedule make_schedule(const FitOptions& options, double distance, bool creases_hold = false);

}  // namespace subvol
