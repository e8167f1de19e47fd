// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/mesh/pyramids.h"

#include "subvol/base/error.h"

#include <algorithm>

namespace subvol::internal {

void require_no_pyramids(std::span<const CellKind> kinds, const std::string& what) {
  const auto count = std::count(kinds.begin(), kinds.end(), CellKind::pyramid);
  if (count == 0) return;
  const auto first = std::find(kinds.begin(), kinds.end(), CellKind::pyramid) - kinds.begin();
  throw InputError(what + "; pyramids in the mesh: " + std::to_string(count) + ", the first is cell " +
                   std::to_string(first) + ". 'subvol template split --into tets' cuts all cells into tets");
}

}  // namespace subvol::internal
