// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/fits/fit_schedule.h"

#include <algorithm>
#include <cmath>

namespace subvol::internal {

namespace {

Stage rough_stage(double lambda, double tangential_weight, const FitTuning& tuning) {
  Stage stage{lambda, tangential_weight};
  stage.linear_tolerance = tuning.rough_tolerance;
  stage.hessian_life = tuning.hessian_life;
  stage.accelerates = true;
  stage.relative_decrease = tuning.accelerated_decrease;
  return stage;
}

}  // namespace

std::vector<Stage> FitSchedule::stages(int number) const {
  if (number > 1) return number == levels ? last : middle;
  std::vector<Stage> result = first;
  if (number == levels) result.insert(result.end(), last.begin(), last.end());
  return result;
}

Stage FitSchedule::final_stage(double lambda) const {
  return rough_stage(lambda, tuning.close_tangential_weight, tuning);
}

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

std::vector<double> own_box_shares(double distance, const FitTuning& tuning) {
  return distance < tuning.close_distance ? std::vector{1.0, 0.5, 0.0} : std::vector{0.0, 0.5, 1.0};
}

FitSchedule make_schedule(const FitOptions& options, double distance, bool creases_hold) {
  const FitTuning& tuning = options.tuning.fitting;
  FitSchedule schedule;
  schedule.tuning = tuning;
  schedule.levels = options.levels;
  schedule.own_box_shares = own_box_shares(distance, tuning);
  const double coarse = std::max(creases_hold ? tuning.held_lambda : tuning.coarse_lambda, options.lambda_close);
  schedule.first = {rough_stage(coarse, tuning.far_tangential_weight, tuning),
                    rough_stage(coarse, tuning.close_tangential_weight, tuning)};
  schedule.middle = {rough_stage(coarse, tuning.close_tangential_weight, tuning)};
  schedule.last = {schedule.final_stage(options.lambda_close)};
  schedule.continuation = {coarse, tuning.far_tangential_weight, 4};
  return schedule;
}

}  // namespace subvol::internal
