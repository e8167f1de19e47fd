// SPDX-License-Identifier: GPL-3.0-or-later
// Stands for the bundled script in builds without node.
#include "subvol/export/viewer_script.h"

namespace subvol::internal {

std::string_view viewer_script() { return {}; }

}  // namespace subvol::internal
