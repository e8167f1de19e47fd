// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/error.h"

#include <string>

namespace subvol {

/// printf into a string, with a decimal point whatever the program's locale; what is beyond 159 characters is cut off.
[[gnu::format(printf, 1, 2)]] std::string formatted(const char* form, ...);

/// InputError, naming the option as owner::name, unless low <= value <= high. NaN is outside.
inline void require_in_range(const char* owner, const char* name, double value, double low, double high) {
  if (!(value >= low && value <= high))
    throw InputError(formatted("%s::%s must be in [%g, %g], got %g", owner, name, low, high, value));
}

}  // namespace subvol
