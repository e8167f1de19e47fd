// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/fits/high_order_schedule.h"

#include <algorithm>

namespace subvol::internal {

Stage HighOrderSchedule::final_stage(double lambda) const {
  return {lambda, fitting.close_tangential_weight, curved.most_steps};
}

std::vector<Stage> HighOrderSchedule::stages(Approach approach, int order, int last_order) const {
  const bool last = order == last_order;
  std::vector<Stage> result;
  if (approach == Approach::direct) {
    if (order == 1) result.push_back({fitting.coarse_lambda, fitting.far_tangential_weight});
    if (!last) result.push_back(final_stage(fitting.coarse_lambda));
  } else {
    const int turn = std::min(curved.stiff_order, last_order);
    if (order <= turn) result.push_back({curved.stiff_lambda, 1, curved.stiff_steps});
    if (order == turn) result.push_back({0.2, 0.3, curved.stiff_steps});
    if (order >= turn) result.push_back({fitting.coarse_lambda, fitting.far_tangential_weight});
  }
  if (last) result.push_back(final_stage(lambda_close));
  return result;
}

HighOrderSchedule make_high_order_schedule(double lambda_close, double distance, const Tuning& tuning) {
  HighOrderSchedule schedule;
  schedule.fitting = tuning.fitting;
  schedule.curved = tuning.curved;
  const std::vector<double> shares = own_box_shares(distance, tuning.fitting);
  schedule.far = shares.front() < 1;
  schedule.tries = {{Approach::direct, shares[0]}};
  if (schedule.far)
    schedule.tries.insert(schedule.tries.end(),
                          {{Approach::direct, shares[2]}, {Approach::stiff, shares[0]}, {Approach::stiff, shares[1]}});
  schedule.lambda_close = lambda_close;
  return schedule;
}

}  // namespace subvol::internal
