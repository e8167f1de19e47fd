// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/fits/fit_schedule.h"

#include <vector>

namespace subvol::internal {

/// How curved elements approach the target.
///
///   direct  lambda 0.05 from order 1 on: no feature of the target is lost
///   stiff   lambda 1 while the orders are raised, then lowered: cells stay well shaped on the way, so templates of few
///           cells can cross distances at which direct fits end with flattened cells
enum class Approach { direct, stiff };

/// One attempt at the first orders.
struct HighOrderTry {
  Approach approach;
  double own_box_share;  ///< `own_share` of the ideal cells at order 1 (`ideal_boxes`)
};

/// The minimizations of a high-order fit, chosen by the template's initial distance.
struct HighOrderSchedule {
  std::vector<HighOrderTry> tries;  ///< in this order; a later one is made if those before went wrong (see below)
  double lambda_close = 0;          ///< lambda of the very last stage
  FitTuning fitting;                ///< of the options that the schedule was made for, as the next
  CurvedTuning curved;

  bool far = false;  ///< true if the template is so far away that its cells do not indicate the wanted shapes
  /// Returns the order up to which attempts are compared and all entities have the same order; the fit's `order` caps
  /// it.
  int first_orders(bool adaptive) const { return far || !adaptive ? 4 : 2; }
  /// Returns the highest order that uses the ideal cells of order 1. Later orders use the cells of the state before.
  int last_common_order() const { return far ? 2 : 1; }
  /// Returns the stages of one order; last_order is the fit's final order.
  std::vector<Stage> stages(Approach approach, int order, int last_order) const;
  /// Returns the last stage with another lambda.
  Stage final_stage(double lambda) const;
};

/// Below this order, the distance does not show if an approach went wrong.
inline constexpr int kTellingOrder = 4;

/// distance  mean distance between template and target, divided by the target's length V/A.
HighOrderSchedule make_high_order_schedule(double lambda_close, double distance, const Tuning& tuning);

}  // namespace subvol::internal
