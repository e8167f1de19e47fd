// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/elements/high_order_mesh.h"

#include <functional>

namespace subvol::internal {

/// Projects a given map onto a space, entity by entity: vertices are interpolated, then the modes of edges, of faces
/// and of cells fit the remainder by least squares, weighted as the integral (order + 2 Gauss points in each direction
/// of the entity's frame).
///
/// map    (cell, canonical point) -> position, finite (else InputError). Each edge and face is evaluated from one of
///        its cells.
///
/// Maps inside the space are reproduced up to rounding. Deterministic; `map` is called from one thread.
/// Cost: for every cell, the number of its points times that of its modes.
HighOrderMesh project_map(const ElementSpace& space, const std::function<Vec3(std::size_t, const Vec3&)>& map);

}  // namespace subvol::internal
