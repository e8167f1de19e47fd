// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/stages/fit_options.h"
#include "subvol/fit/stages/stage.h"

#include <vector>

namespace subvol::internal {

/// The minimizations of a recursive fit.
///
/// Lambda is low from the start: a stiff start (lambda > 0.05) shrinks and rounds the template and loses features that
/// never come back. The template's initial distance only decides which ideal cells are tried first.
struct FitSchedule {
  /// For each attempt, the `own_share` of the ideal cells on level 1 (`ideal_boxes`). A later attempt is made if a
  /// level cannot be started without inverting a cell.
  std::vector<double> own_box_shares;
  int levels = 0;
  std::vector<Stage> first, middle, last;  ///< stages of level 1, of the levels between, and of the finest level
  Stage continuation;
  FitTuning tuning;  ///< of the options that the schedule was made for

  /// Returns the stages of a level; if there is only one level, those of `first` and `last`.
  std::vector<Stage> stages(int number) const;
  /// Returns the last stage with another lambda.
  Stage final_stage(double lambda) const;
  /// Returns the number of quadrature points per direction. Points are nested from level to level, so that no child
  /// starts inverted at one of its points.
  int quadrature_points(int number) const { return number == 1 ? 5 : number == 2 ? 3 : 2; }
  /// Returns an estimate of the share of the work that is done when the stages of a level end.
  /// raises_quality  true if quality stages follow on the finest level.
  double share_at_end(int number, bool raises_quality) const;
};

/// Number of steps that the stages of a level are expected to take together.
inline constexpr double kExpectedLevelSteps = 12;

/// Returns the `own_share` values (`ideal_boxes`) to be tried on level 1, first choice first.
///
/// distance  as in `make_schedule`.
std::vector<double> own_box_shares(double distance, const FitTuning& tuning);

/// Makes the schedule of a fit.
///
/// distance      mean distance between template and target, divided by the target's length V/A.
/// creases_hold  true if creases are drawn to most of the target's sharp edges.
FitSchedule make_schedule(const FitOptions& options, double distance, bool creases_hold = false);

}  // namespace subvol::internal
