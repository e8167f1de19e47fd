// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/base/types.h"

#include <functional>

namespace subvol {

/// The shape that a cell should have at one of its points if that is not the ideal cell's: a matrix A with det A > 0
/// whose columns are the desired derivatives along the canonical axes (up to a common rotation), in the mesh's unit.
///
///   F = dx/du A^-1,  u canonical (`cell_topology.h`)                           Paper: section 4.4
///
/// It is called from many threads at once.
using CellReference = std::function<Mat3(Index cell, const Vec3& point)>;

}  // namespace subvol
