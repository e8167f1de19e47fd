// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <string_view>

namespace subvol::internal {

/// Returns text for XML or HTML, also for attributes in quotes of either kind: & < > " ' become entities, and control
/// characters other than tabs and line breaks, which XML does not allow, become blanks.
std::string escaped_markup(std::string_view text);

}  // namespace subvol::internal
