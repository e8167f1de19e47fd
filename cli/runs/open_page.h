// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>

namespace subvol::cli {

/// Shows a page in the user's browser: starts xdg-open (on a Mac, open) and does not wait for it. IoError: it cannot be
/// started.
void open_in_browser(const std::filesystem::path& page);

}  // namespace subvol::cli
