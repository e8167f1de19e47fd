// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace subvol::cli {

/// Splits a text into words at blanks and tabs.
///
/// 'Quotes' and "quotes" keep blanks within a word and are dropped; there are no other special characters.
/// InputError: a quote is not closed.
std::vector<std::string> split_words(std::string_view text);

}  // namespace subvol::cli
