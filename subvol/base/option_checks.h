// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/error.h"
#include "subvol/base/format.h"

namespace subvol::internal {

/// Throws InputError, naming the option as owner::name, unless low <= value <= high. NaN is refused, too.
inline void require_in_range(const char* owner, const char* name, double value, double low, double high) {
  if (!(value >= low && value <= high))
    throw InputError(formatted("%s::%s must be in [%g, %g], got %g", owner, name, low, high, value));
}

}  // namespace subvol::internal
