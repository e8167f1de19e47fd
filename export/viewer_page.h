// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/export/viewer_content.h"

#include <string>

namespace subvol::internal {

/// True if the program was built with the viewer (`viewer_script`).
bool has_viewer();

/// Returns a page that shows the content and lets one turn, cut and filter it: one HTML file, which loads nothing.
///
/// Positions are written in single precision, relative to the middle of the first mesh. InputError: no mesh, a position
/// that is not finite, arrays whose lengths do not fit together. Throws std::logic_error without `has_viewer`.
/// Cost: about 50 ns and 3 to 15 bytes of page per corner of a cell, besides 600 kB for the script.
std::string viewer_page(const ViewerContent& content);

/// Returns the same as a part of a larger page: an element, and a script that must follow it.
std::string viewer_element(const ViewerContent& content);

}  // namespace subvol::internal
