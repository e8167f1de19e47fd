// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/mesh/cell_topology.h"

#include <span>
#include <string>

namespace subvol::internal {

/// Throws InputError with the number of a mesh's pyramids, if it has any, and what to do instead.
/// kinds  of its cells
/// what   who asks, and the reason: "template mesh: pyramids cannot be curved"
void require_no_pyramids(std::span<const CellKind> kinds, const std::string& what);

}  // namespace subvol::internal
