// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/mesh/volume_mesh.h"
#include "subvol/surface/triangle_mesh.h"

#include <functional>
#include <span>
#include <vector>

namespace subvol {

/// Keeps the cells that a predicate chooses, with their references, on the vertices they use; both keep their order.
/// Tags stay where their edge or vertex is still on the boundary.
///
/// mesh    index-correct cells.
/// InputError: no cell is kept; what is kept touches itself along an edge or at a vertex, with the place: its boundary
/// would be no manifold (`validate`).
VolumeMesh carve(const VolumeMesh& mesh, const std::function<bool(std::size_t cell)>& keep);

/// The cells that lie in a surface by at least a share of their volume, non-zero for those to keep.
///
/// A cell counts by the mean over 27 points of whether the generalised winding number (`WindingNumber`) is above 1/2;
/// so the surface may have holes. least_share  in (0, 1], else InputError. InputError as `WindingNumber`.
std::vector<char> cells_inside(const VolumeMesh& mesh, const TriangleMesh& surface, double least_share = 0.5);

/// The cells whose centre (mean of the corners) lies in a closed box.
std::vector<char> cells_in_box(const VolumeMesh& mesh, const Vec3& low, const Vec3& high);

/// The cells listed. InputError: a number out of range.
std::vector<char> cells_listed(const VolumeMesh& mesh, std::span<const Index> cells);

}  // namespace subvol
