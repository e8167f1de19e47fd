// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string_view>

namespace subvol::internal {

/// The viewer as one script for a page, bundled with three.js when the program was built (export/viewer/build.mjs).
/// Empty if node or its packages were not there then.
std::string_view viewer_script();

}  // namespace subvol::internal
