// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/fits/fit_schedule.h"

#include <algorithm>
#include <cmath>

namespace subvol::internal {

namespace {

/// Initial distance (in V/A) below which the template's own cells indicate the shape of the fitted cells (measured on
/// real templates).
constexpr double kCloseDistance = 0.4;
/// Lambda if creases are drawn to the target from the start: stiffer cells swell beside the creases, and the folds that
/// this makes do not disappear later.
constexpr double kHeldLambda = 0.01;
/// Stages that take many steps solve their systems roughly and keep the cells' Hessian, which makes a step cheaper. A
/// continuation does neither: its few steps must free every cell.
constexpr double kRoughTolerance = 0.3;
constexpr int kHessianLife = 4;  // steps
/// Accelerated steps decrease E by more, so these stages end at larger decreases than others: E is then what it is at
/// the end of many more plain steps.
constexpr double kAcceleratedDecrease = 5e-3;

Stage rough_stage(double lambda, double tangential_weight) {
  Stage stage{lambda, tangential_weight};
  stage.linear_tolerance = kRoughTolerance;
  stage.hessian_life = kHessianLife;
  stage.accelerates = true;
  stage.relative_decrease = kAcceleratedDecrease;
  return stage;
}

}  // namespace

std::vector<Stage> FitSchedule::stages(int number) const {
  if (number > 1) return number == levels ? last : middle;
  std::vector<Stage> result = first;
  if (number == levels) result.insert(result.end(), last.begin(), last.end());
  return result;
}

Stage FitSchedule::final_stage(double lambda) const { return rough_stage(lambda, kCloseTangentialWeight); }

double FitSchedule::share_at_end(int number, bool raises_quality) const {
  // A step of a level costs about a quarter of one of the next: that has eight times the cells, but fewer quadrature
  // points in each.
  constexpr double kNextLevel = 4, kQuality = 1;
  double before = 0, all = 0;
  for (int level = 1; level <= levels; ++level) {
    all += std::pow(kNextLevel, level);
    if (level == number) before = all;
  }
  if (raises_quality) all += kQuality * std::pow(kNextLevel, levels);
  return before / all;
}

std::vector<double> own_box_shares(double distance) {
  return distance < kCloseDistance ? std::vector{1.0, 0.5, 0.0} : std::vector{0.0, 0.5, 1.0};
}

FitSchedule make_schedule(const FitOptions& options, double distance, bool creases_hold) {
  FitSchedule schedule;
  schedule.levels = options.levels;
  schedule.own_box_shares = own_box_shares(distance);
  const double coarse = std::max(creases_hold ? kHeldLambda : kCoarseLambda, options.lambda_close);
  schedule.first = {rough_stage(coarse, kFarTangentialWeight), rough_stage(coarse, kCloseTangentialWeight)};
  schedule.middle = {rough_stage(coarse, kCloseTangentialWeight)};
  schedule.last = {schedule.final_stage(options.lambda_close)};
  schedule.continuation = {coarse, kFarTangentialWeight, 4};
  return schedule;
}

}  // namespace subvol::internal
