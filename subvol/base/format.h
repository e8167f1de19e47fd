// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

namespace subvol::internal {

/// Formats like printf into a string, with a decimal point in any locale. Text beyond 239 characters is cut off.
[[gnu::format(printf, 1, 2)]] std::string formatted(const char* form, ...);

}  // namespace subvol::internal
