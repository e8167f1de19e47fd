// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/base/format.h"

#include <locale.h>

#include <cstdarg>
#include <cstdio>

namespace subvol::internal {

std::string formatted(const char* form, ...) {
  static const locale_t plain = newlocale(LC_ALL_MASK, "C", nullptr);
  const locale_t before = uselocale(plain);  // affects this thread only
  char text[240];
  std::va_list values;
  va_start(values, form);
  std::vsnprintf(text, sizeof text, form, values);
  va_end(values);
  uselocale(before);
  return text;
}

}  // namespace subvol::internal
