// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace subvol::internal {

/// Appends bytes as base64, four digits for three bytes.
void append_base64(std::string& text, std::string_view bytes);
/// Returns the bytes, or nothing if a character or the length is invalid in base64.
std::optional<std::string> decode_base64(std::string_view digits);

}  // namespace subvol::internal
