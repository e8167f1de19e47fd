// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface/triangle_mesh.h"

#include <optional>

namespace subvol::internal {

/// Returns the surface of the union of two solids, or of the first without the second.
///
/// a, b   closed surfaces whose normals point outward and which do not meet themselves; no two vertices of one are in
///        one place. They may cross, overlap in faces or lie in each other.
/// returns  closed, outward; new vertices are rounded to doubles. Nothing if the result would not be a manifold (solids
///          that touch along an edge or at a vertex), or if a surface is not as wanted.
std::optional<TriangleMesh> united(const TriangleMesh& a, const TriangleMesh& b);
std::optional<TriangleMesh> without(const TriangleMesh& a, const TriangleMesh& b);

}  // namespace subvol::internal
