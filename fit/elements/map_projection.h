// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "fit/elements/high_order_mesh.h"

#include <functional>

namespace subvol {

/// The mesh that follows a given map, entity by entity: vertices are met, then the modes of edges, of faces and of
/// cells take what is left there, by least squares weighted as the integral (Gauss points in the entity's frame, order
/// + 2 in each direction).
///
/// map    (cell, canonical point) -> position, finite (else InputError). Every edge and face is asked about from one of
///        its cells.
///
/// Maps inside the space are reproduced up to rounding. Deterministic; `map` is called from one thread.
/// Cost: for every cell, its points times its modes.
HighOrderMesh project_map(const ElementSpace& space, const std::function<Vec3(std::size_t, const Vec3&)>& map);

}  // namespace subvol
