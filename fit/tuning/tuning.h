// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/tuning/automatic_tuning.h"
#include "subvol/fit/tuning/curved_tuning.h"
#include "subvol/fit/tuning/fit_tuning.h"
#include "subvol/fit/tuning/optimize_tuning.h"
#include "subvol/fit/tuning/quality_tuning.h"

namespace subvol {

/// The tuned numbers of all methods, which options pass on. The defaults are what all measured figures belong to; other
/// values are for experiments. `set_tuned_number` checks their ranges, the methods do not.
struct Tuning {
  FitTuning fitting;
  CurvedTuning curved;
  QualityTuning quality;
  AutomaticTuning automatic;
  OptimizeTuning optimize;
};

}  // namespace subvol
