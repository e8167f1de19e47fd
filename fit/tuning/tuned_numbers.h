// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/tuning/tuning.h"

#include <string>
#include <string_view>
#include <vector>

namespace subvol {

/// A number of a `Tuning`.
struct TunedNumber {
  std::string name;  ///< part and member, such as "fitting.coarse_lambda"
  double value = 0;
};

/// Returns all numbers, part by part, in the order in which they are declared.
std::vector<TunedNumber> tuned_numbers(const Tuning& tuning);

/// Sets the number with this name, such as "fitting.coarse_lambda".
///
/// value  If the default is below 1, from 1e-9 to 0.99: the number may be a share or a factor that has to shrink. If it
///        is above 1, from 1.01 to 1000 times it: the number may be a factor that has to grow. If it is 1, from 1 to
///        1000. Numbers that count something are whole, and from 1 to 1000 times the default. Five have lower
///        bounds: curved.stiffening_factor 100, curved.most_stiffenings 10, curved.least_intervals_per_order
///        20, curved.most_points_per_direction 100, quality.least_fold_limit 359.
/// InputError: there is no such number, or the value is out of this range; the message names both.
void set_tuned_number(Tuning& tuning, std::string_view name, double value);

}  // namespace subvol
