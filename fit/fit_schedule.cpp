// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/fit_schedule.h"

#include <algorithm>
#include <cmath>

namespace subvol {

namespace {

/// Measured on real templates: graded ones that lie close need sizes between common and their own (a common size would
/// turn their small cells inside out); for all others the common size gives better cells, and far away own sizes mislead.
constexpr double kCloseDistance = 0.4, kGradedSpread = 0.4;
constexpr double kCoarseLambda = 0.05;
constexpr double kFarTangentialWeight = 0.1, kCloseTangentialWeight = 0.003;
constexpr double kCoarseDecrease = 1e-3, kFinalDecrease = 3e-4;

}  // namespace

std::vector<Stage> FitSchedule::stages(int number) const {
  std::vector<Stage> result = number == 1 ? first : middle;
  if (number == levels) result.insert(result.end(), last.begin(), last.end());
  return result;
}

Stage FitSchedule::final_stage(double lambda) const { return {lambda, kCloseTangentialWeight, 20, kFinalDecrease}; }

double FitSchedule::fraction(int number) const { return std::pow(0.25, levels - number + 1); }

double logarithmic_spread(std::span<const double> sizes) {
  if (sizes.empty()) return 0;
  double sum = 0, squares = 0;
  for (double h : sizes) {
    sum += std::log(h);
    squares += std::log(h) * std::log(h);
  }
  const double mean = sum / static_cast<double>(sizes.size());
  return std::sqrt(std::max(0.0, squares / static_cast<double>(sizes.size()) - mean * mean));
}

FitSchedule make_schedule(const FitOptions& options, double distance, double size_spread) {
  FitSchedule schedule;
  schedule.levels = options.levels;
  schedule.size_blend = distance < kCloseDistance && size_spread > kGradedSpread ? 0.5 : 0;
  const double coarse = std::max(kCoarseLambda, options.lambda_close);
  schedule.first = {{coarse, kFarTangentialWeight, 20, kCoarseDecrease}, {coarse, kCloseTangentialWeight, 20, kCoarseDecrease}};
  schedule.middle = {{coarse, kCloseTangentialWeight, 20, kCoarseDecrease}};
  if (options.lambda_close < coarse) schedule.last = {schedule.final_stage(options.lambda_close)};
  schedule.continuation = {coarse, kFarTangentialWeight, 4};
  return schedule;
}

}  // namespace subvol
