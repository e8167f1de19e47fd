// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace subvol {

/// Returns the library's version, "major.minor.patch", as it stands in reports and exported files.
const char* version();

}  // namespace subvol
