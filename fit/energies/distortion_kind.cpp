// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/energies/distortion_kind.h"

namespace subvol {

const char* to_string(Distortion distortion) {
  switch (distortion) {
    case Distortion::hencky: return "hencky";
    case Distortion::inverse_mean_ratio: return "inverse_mean_ratio";
    case Distortion::condition_number: return "condition_number";
  }
  return "unknown";
}

}  // namespace subvol
