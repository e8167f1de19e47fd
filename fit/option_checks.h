// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/error.h"

#include <cstdio>
#include <string>

namespace subvol {

/// printf into a string; what is beyond 159 characters is cut off.
template <class... Values>
std::string formatted(const char* form, Values... values) {
  char text[160];
  std::snprintf(text, sizeof text, form, values...);
  return text;
}

/// InputError, naming the option as owner::name, unless low <= value <= high. NaN is outside.
inline void require_in_range(const char* owner, const char* name, double value, double low, double high) {
  if (!(value >= low && value <= high))
    throw InputError(formatted("%s::%s must be in [%g, %g], got %g", owner, name, low, high, value));
}

}  // namespace subvol
