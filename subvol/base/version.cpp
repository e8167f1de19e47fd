// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/base/version.h"

namespace subvol {

const char* version() { return SUBVOL_VERSION; }

}  // namespace subvol
