// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/io/nodal_mesh.h"

#include <cstddef>

namespace subvol::internal {

/// Numbers cells anew, of files in which a cell and its mirror image may have the same numbering, so that all are of
/// one orientation.
///
/// Cells that are connected through faces get numbers with which they see their common faces from opposite sides and
/// the sum of their volumes is not negative. Cells stay as they are if no numbers do that, or if all do already: those
/// that are left-handed because their corners are in the wrong place are no reason to change others.
///
/// returns  number of cells whose nodes were numbered anew.
std::size_t turn_cells_alike(NodalMesh& mesh);

}  // namespace subvol::internal
