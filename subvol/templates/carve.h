// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/mesh/volume_mesh.h"
#include "subvol/surface/triangle_mesh.h"

#include <functional>
#include <span>
#include <vector>

namespace subvol {

/// Keeps the cells that a predicate selects, with their references, and the vertices that these cells use; cells and
/// vertices keep their order. Tags stay if their edge or vertex is still on the boundary.
///
/// mesh    a mesh whose cells have valid indices.
/// InputError: no cell is kept; the kept part touches itself along an edge or at a vertex, so that its boundary would
/// not be a manifold (`validate`). The message names the place.
VolumeMesh carve(const VolumeMesh& mesh, const std::function<bool(std::size_t cell)>& keep);

/// Marks the cells of which at least a share of the volume lies inside a surface: non-zero for those to keep.
///
/// The share of a cell is the fraction of 27 sample points at which the generalized winding number (`WindingNumber`)
/// exceeds 1/2; so the surface may have holes.
/// least_share  in (0, 1], else InputError. InputError: also for a surface without triangles, with a vertex number out
///              of range or with a position that is not finite.
std::vector<char> cells_inside(const VolumeMesh& mesh, const TriangleMesh& surface, double least_share = 0.5);

/// Marks the cells whose center (mean of the corners) lies in a closed box.
std::vector<char> cells_in_box(const VolumeMesh& mesh, const Vec3& low, const Vec3& high);

/// Marks the listed cells. InputError: a cell number out of range.
std::vector<char> cells_listed(const VolumeMesh& mesh, std::span<const Index> cells);

}  // namespace subvol
