// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/fits/high_order_schedule.h"

#include <algorithm>

namespace subvol::internal {

namespace {

/// Lambda of a stiff approach: 20 times that of other stages.
constexpr double kStiffLambda = 1;
constexpr int kMaxIterations = 40;  // steps of a stage; most end earlier
/// Stiff stages only lead the way: after this many steps, the next stage makes faster progress.
constexpr int kStiffIterations = 10;
/// Order from which on a stiff approach lowers lambda.
constexpr int kStiffOrder = 4;

}  // namespace

Stage HighOrderSchedule::final_stage(double lambda) const { return {lambda, kCloseTangentialWeight, kMaxIterations}; }

std::vector<Stage> HighOrderSchedule::stages(Approach approach, int order, int last_order) const {
  const bool last = order == last_order;
  std::vector<Stage> result;
  if (approach == Approach::direct) {
    if (order == 1) result.push_back({kCoarseLambda, kFarTangentialWeight});
    if (!last) result.push_back(final_stage(kCoarseLambda));
  } else {
    const int turn = std::min(kStiffOrder, last_order);
    if (order <= turn) result.push_back({kStiffLambda, 1, kStiffIterations});
    if (order == turn) result.push_back({0.2, 0.3, kStiffIterations});
    if (order >= turn) result.push_back({kCoarseLambda, kFarTangentialWeight});
  }
  if (last) result.push_back(final_stage(lambda_close));
  return result;
}

HighOrderSchedule make_high_order_schedule(double lambda_close, double distance) {
  HighOrderSchedule schedule;
  const std::vector<double> shares = own_box_shares(distance);
  schedule.far = shares.front() < 1;
  schedule.tries = {{Approach::direct, shares[0]}};
  if (schedule.far)
    schedule.tries.insert(schedule.tries.end(),
                          {{Approach::direct, shares[2]}, {Approach::stiff, shares[0]}, {Approach::stiff, shares[1]}});
  schedule.lambda_close = lambda_close;
  return schedule;
}

}  // namespace subvol::internal
