// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/fits/fit_schedule.h"

#include <vector>

namespace subvol {

/// How curved elements come near the target.
///
///   direct  lambda 0.05 from order 1 on: no feature of the target is lost
///   stiff   lambda 1 while the orders are raised, then lowered: cells stay well shaped on the way, which carries
///   templates
///           of few cells over distances where direct fits end among flattened cells
enum class Approach { direct, stiff };

/// One attempt at the first orders.
struct HighOrderTry {
  Approach approach;
  double own_box_share;  ///< of the ideal cells at order 1 (`ideal_boxes`)
};

/// Which minimisations a high-order fit runs, decided from the template's initial distance.
struct HighOrderSchedule {
  std::vector<HighOrderTry> tries;  ///< a later one is made where those before went wrong (`kFairDistancePercent`)
  double lambda_close = 0;          ///< of the last stage of all

  bool far = false;  ///< the template's cells do not tell what is wanted
  /// Up to this order (at most `order`) tries are made, and all entities have the same order.
  int first_orders(bool adaptive) const { return far || !adaptive ? 4 : 2; }
  /// Up to this order ideal cells are those of order 1; from then on, those of the state before.
  int last_common_order() const { return far ? 2 : 1; }
  std::vector<Stage> stages(Approach approach, int order, int last_order) const;
  Stage final_stage(double lambda) const;
};

/// The first orders of a far template are tried in another way where the mean distance, in per cent of the diagonal, is
/// above the one and E_W above the other: far from the target for what cells suffer, not for what they cannot
/// represent.
inline constexpr double kFairDistancePercent = 0.12, kFairDistortion = 0.3;
/// Below this order the distance does not tell whether an approach went wrong.
inline constexpr int kTellingOrder = 4;

/// Where a fit's boundary intersects itself, lambda is raised up to this.
inline constexpr double kMostUnfoldingLambdaOfOrders = 1;

/// distance  mean distance of template and target by the target's length V/A.
HighOrderSchedule make_high_order_schedule(double lambda_close, double distance);

}  // namespace subvol
