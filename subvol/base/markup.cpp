// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/base/markup.h"

namespace subvol::internal {

std::string escaped_markup(std::string_view text) {
  std::string result;
  for (const char c : text) switch (c) {
      case '&': result += "&amp;"; break;
      case '<': result += "&lt;"; break;
      case '>': result += "&gt;"; break;
      case '"': result += "&quot;"; break;
      case '\'': result += "&#39;"; break;
      default: result += static_cast<unsigned char>(c) >= ' ' || c == '\t' || c == '\n' ? c : ' ';
    }
  return result;
}

}  // namespace subvol::internal
